"""Gale Crater: a way planned on the real elevation beside the one that Curiosity drove.

From Bradbury Landing to where the rover is now, on 463 m cells whose cost grows with their slope. Needs
the folder ``gale`` (elevation by MOLA, the rover's stops) in ``../shared/data``, or where the first argument
says. What was driven is measured from stop to stop; the odometer says 38 km. Draws ``curiosity.png``.
"""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.relief import Relief, relief
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.elevation_file import read_elevation
from pilotage.stack.planning.grid_space import GridSpace

SLOPE_THAT_DOUBLES_DEG = 5.0
"""On this slope a metre costs two."""

SLOPE_LIMIT_DEG = 20.0
"""What is steeper, over cells of 463 m, is not driven on at all."""


def load(folder: Path) -> tuple[ElevationModel, FloatArray, float]:
    """The elevation, its frame x east and y north in Bradbury Landing, the stops (N, 2), the odometer."""
    side = json.loads((folder / "gale-mola.json").read_text())
    landing = side["origin"]
    x_m = landing["pixelCol"] * side["metresPerPixelLon"]
    y_m = (side["size"] - landing["pixelRow"]) * side["metresPerPixelLat"]
    traverse = json.loads((folder / "msl-traverse.json").read_text())
    stops = traverse["points"]
    # The file's z points south.
    driven = np.array([[stop["x"], -stop["z"]] for stop in stops])
    elevation = read_elevation(folder / "gale-mola.json", Pose2(-x_m, -y_m, 0.0))
    return elevation, driven, float(traverse["totalMetres"])


def told(name: str, path_m: FloatArray, ground: ElevationModel) -> Relief:
    """Length, climb and steepest slope, every 100 m on the same elevation for both paths."""
    profile = relief(ground, path_m, 100.0)
    steepest = np.rad2deg(profile.steepest_rad)
    climbs = f"climbs {profile.climb_m:4.0f} m"
    print(f"{name:8s} {profile.s_m[-1] / 1000.0:5.1f} km, {climbs}, steepest {steepest:4.1f} deg")
    return profile


folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "shared" / "data" / "gale"
if not folder.is_dir():
    print(f"nothing to show: no data in {folder}")
    sys.exit()
ground, driven, odometer_m = load(folder)
grid = ground.hazards(SLOPE_LIMIT_DEG)
space = GridSpace(grid.blocked(), ground.cost_factors(SLOPE_THAT_DOUBLES_DEG))
path = space.shortest(grid.cell_at(*driven[0]), grid.cell_at(*driven[-1]))
assert path is not None
planned = np.concatenate([driven[:1], grid.centres_m(path.cells)[1:-1], driven[-1:]])
paths = {"driven": (driven, "tab:orange"), "planned": (planned, "tab:blue")}
profiles = {name: told(name, path_m, ground) for name, (path_m, _) in paths.items()}
print(f"The rover's odometer says {odometer_m / 1000.0:.1f} km: it turned and slipped between its stops.")

figure, (axes, along) = plt.subplots(1, 2, figsize=(11, 8), width_ratios=(3, 2), layout="constrained")
left, bottom = ground.origin.x_m / 1000.0, ground.origin.y_m / 1000.0
extent = (left, left + grid.size_m[0] / 1000.0, bottom, bottom + grid.size_m[1] / 1000.0)
low, high = driven.min(axis=0) / 1000.0 - 4.0, driven.max(axis=0) / 1000.0 + 4.0
# Heights between the lowest and the highest that the picture shows.
near = [grid.cell_at(*(1000.0 * corner)) for corner in (low, high)]
shown = ground.elevation_m[near[1][0] : near[0][0], near[0][1] : near[1][1]]
heights = axes.imshow(
    ground.elevation_m, cmap="bone", vmin=shown.min() - 800.0, vmax=shown.max(), extent=extent
)
x, y = (np.linspace(extent[k], extent[k + 1], n) for k, n in ((0, grid.columns), (2, grid.rows)))
axes.contour(
    x, y[::-1], ground.elevation_m, np.arange(-5000, 3000, 100), colors="k", linewidths=0.3, alpha=0.5
)
for name, (path_m, colour) in paths.items():
    axes.plot(*(path_m.T / 1000.0), color="white", linewidth=3.5)
    axes.plot(*(path_m.T / 1000.0), color=colour, linewidth=1.8, label=name)
    along.plot(profiles[name].s_m / 1000.0, profiles[name].elevation_m, color=colour, label=name)
for place, name in ((driven[0], "Bradbury Landing"), (driven[-1], "today")):
    axes.plot(*(place / 1000.0), "o", color="black", markeredgecolor="white")
    axes.annotate(
        name,
        place / 1000.0,
        (8, -3),
        textcoords="offset points",
        bbox={"fc": "white", "ec": "none", "pad": 1.5},
    )
axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="east, km", ylabel="north, km")
axes.set_title("Gale Crater by MOLA; contours every 100 m")
figure.colorbar(heights, ax=axes, label="height, m", shrink=0.7)
along.set(xlabel="distance along the way, km", ylabel="height, m", title="Heights along both paths")
along.legend()
along.grid(alpha=0.3)
figure.savefig("curiosity.png", dpi=120)
print("drawn: curiosity.png")
