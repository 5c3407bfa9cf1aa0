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
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.elevation_file import read_elevation
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.stack.planning.grid_space import GridSpace

SLOPE_THAT_DOUBLES_RAD = np.deg2rad(5.0)
"""On this slope a metre costs two."""


def load(folder: Path) -> tuple[ElevationModel, FloatArray]:
    """The elevation, its frame x east and y north in Bradbury Landing, and the stops (N, 2)."""
    side = json.loads((folder / "gale-mola.json").read_text())
    landing = side["origin"]
    x_m = landing["pixelCol"] * side["metresPerPixelLon"]
    y_m = (side["size"] - landing["pixelRow"]) * side["metresPerPixelLat"]
    stops = json.loads((folder / "msl-traverse.json").read_text())["points"]
    # The file's z points south.
    driven = np.array([[stop["x"], -stop["z"]] for stop in stops])
    return read_elevation(folder / "gale-mola.json", Pose2(-x_m, -y_m, 0.0)), driven


def told(name: str, way_m: FloatArray, ground: ElevationModel) -> str:
    """Length, climb and steepest slope, every 100 m on the same elevation for both ways."""
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way_m, axis=0).T))])
    at_m = np.append(np.arange(0.0, s_m[-1], 100.0), s_m[-1])
    points = np.column_stack([np.interp(at_m, s_m, way_m[:, k]) for k in (0, 1)])
    rises = np.diff(ground.heights_at(points))
    steepest = np.rad2deg(np.arctan(np.abs(rises / np.diff(at_m)).max()))
    climb_m = rises[rises > 0.0].sum()
    return f"{name:8s} {s_m[-1] / 1000.0:5.1f} km, climbs {climb_m:4.0f} m, steepest {steepest:4.1f} deg"


folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "shared" / "data" / "gale"
if not folder.is_dir():
    print(f"nothing to show: no data in {folder}")
    sys.exit()
ground, driven = load(folder)
slope = ground.slope_rad().astype(np.float64)
grid = OccupancyGrid.of(np.zeros(slope.shape, np.bool_), ground.resolution_m, ground.origin)
space = GridSpace(grid.blocked(), 1.0 + (slope / SLOPE_THAT_DOUBLES_RAD) ** 2)
path = space.shortest(grid.cell_at(*driven[0]), grid.cell_at(*driven[-1]))
assert path is not None
planned = np.concatenate([driven[:1], grid.centres_m(path.cells)[1:-1], driven[-1:]])
print(told("planned", planned, ground))
print(told("driven", driven, ground))

figure, axes = plt.subplots(figsize=(9, 9))
left, bottom = ground.origin.x_m / 1000.0, ground.origin.y_m / 1000.0
extent = (left, left + grid.size_m[0] / 1000.0, bottom, bottom + grid.size_m[1] / 1000.0)
axes.imshow(ground.shaded(), cmap="gray", extent=extent)
for way_m, style, name in ((driven, "tab:orange", "driven"), (planned, "tab:cyan", "planned")):
    axes.plot(*(way_m.T / 1000.0), color=style, label=name)
low, high = driven.min(axis=0) / 1000.0 - 4.0, driven.max(axis=0) / 1000.0 + 4.0
axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="east, km", ylabel="north, km")
axes.set_title("From Bradbury Landing, on the elevation by MOLA")
axes.legend()
figure.savefig("curiosity.png", dpi=120)
print("drawn: curiosity.png")
