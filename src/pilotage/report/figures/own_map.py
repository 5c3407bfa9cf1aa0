"""The map that an explorer made, under the walls that truly stand there."""

from __future__ import annotations

from pilotage.records.run_data import RunData
from pilotage.report.figures import layers
from pilotage.report.figures.grid import OCCUPIED_COLOUR, UNKNOWN_COLOUR, draw_grid
from pilotage.report.figures.map_view import map_axes, view_limits
from pilotage.report.style import SKY, VERMILLION, Illustration, Key, render

SLUG, TITLE = "own-map", "The map that the robot made"


def own_map_figure(run: RunData) -> Illustration:
    """Draw the robot's map; nothing where it made none."""
    grid, limits = run.own_map, view_limits(run)
    if grid is None or limits is None:
        return Illustration(SLUG, TITLE, "", "")
    figure, axes, _ = map_axes(limits)
    draw_grid(axes, grid)
    layers.line(axes, layers.estimated_path(run), "estimated", color=SKY, linewidth=1.2, zorder=4)
    layers.segments(axes, run.world.segments_m, "walls", color=VERMILLION, linewidth=0.7, zorder=5)
    caption = (
        f"White is free, dark is wall, grey was never seen; cells of {grid.resolution_m:g} m. What truly "
        "stands there lies over it as thin lines. The run folder's map.yaml and map.pgm hold the map for ROS "
        "and for the next mission."
    )
    candidates = (
        (True, Key("wall", OCCUPIED_COLOUR, "band", "grid", 1.0)),
        (True, Key("never seen", UNKNOWN_COLOUR, "band", opacity=1.0)),
        (run.trace.has("est_x_m"), Key("path as it believed", SKY, "line", "estimated")),
        (len(run.world.segments_m) > 0, Key("true walls", VERMILLION, "line", "walls")),
    )
    alt = f"The map that the robot of the run {run.name} made, and the true walls"
    keys = tuple(key for there, key in candidates if there)
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)
