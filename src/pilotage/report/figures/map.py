"""The map: the world as it was, what the robot planned, believed and did, and where things happened."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.figures import layers, map_marks
from pilotage.report.figures.grid import OCCUPIED_COLOUR, UNKNOWN_COLOUR, draw_grid, has_unknown
from pilotage.report.figures.map_view import Limits, map_axes, view_limits
from pilotage.report.style import (
    BLACK,
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Illustration,
    Key,
    one_shape,
    render,
)

SLUG = "map"
TITLE = "The map"

_MAGNIFICATIONS = (1000, 500, 200, 100, 50, 20, 10, 5, 2)


def map_figure(run: RunData) -> Illustration:
    """Draw the whole run on its map, to scale, every layer switchable."""
    limits = view_limits(run)
    if limits is None:
        return Illustration(SLUG, TITLE, "", "The run recorded neither a map nor a path.")
    figure, axes, points_per_m = map_axes(limits)
    world = run.world
    placer = map_marks.label_placer(run, axes, points_per_m)

    layers.draw_tree(axes, run)
    layers.draw_plans(axes, run)
    layers.draw_obstacles(axes, world)
    if run.grid is None:
        layers.draw_walls(axes, world)
    else:
        draw_grid(axes, run.grid)
    # A cell of a third of a millimetre on the page: closer points are one dot.
    layers.draw_mapped_points(axes, run, max(0.04, 1.6 / points_per_m))
    layers.draw_shortest(axes, run)
    layers.draw_paths(axes, run)
    magnification = _draw_ellipses(axes, run, max(limits[2] - limits[0], limits[3] - limits[1]))
    map_marks.draw_robot(axes, run, placer, points_per_m)
    map_marks.draw_events(axes, run, placer, points_per_m)
    map_marks.draw_beacons(axes, run, placer, points_per_m)

    caption = _caption(run, limits, magnification)
    alt = f"Map of the run {run.name} with walls, planned, true and estimated path and the places of events"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), _keys(run, magnification))


def _draw_ellipses(axes: Axes, run: RunData, size_m: float) -> int:
    """Draw the 95 % ellipses to scale, and magnified where they would be too small to see."""
    trace = run.trace
    if not trace.has("cov_xx_m2", "cov_xy_m2", "cov_yy_m2", "est_x_m"):
        return 0
    half_axes = layers.semi_axis(run)
    settled = run.settled() & np.isfinite(half_axes)
    typical = float(np.median(half_axes[settled])) if bool(settled.any()) else math.nan
    magnification = (
        next((m for m in _MAGNIFICATIONS if typical * m <= 0.016 * size_m), 1) if typical > 0.0 else 1
    )
    spacing_m = max(2.5 * magnification * typical if typical > 0.0 else 0.0, 0.02 * size_m)
    steps = _evenly_along(layers.estimated_path(run), spacing_m)
    to_scale = layers.ellipse_outlines(run, steps)
    one_shape(
        axes, to_scale, facecolor="none", edgecolor=BLACK, linewidth=0.3, zorder=8.5, gid="layer-ellipses"
    )
    if magnification > 1:
        # The start's wide ellipse would cover the map.
        fitting = [
            step for step in steps if settled[step] and half_axes[step] * magnification < 0.06 * size_m
        ]
        one_shape(
            axes,
            layers.ellipse_outlines(run, fitting, magnification),
            facecolor=SKY,
            edgecolor=BLUE,
            linewidth=0.7,
            alpha=0.35,
            zorder=6.8,
            gid="layer-magnified",
        )
    return magnification


def _evenly_along(path: FloatArray, spacing_m: float) -> list[int]:
    """Return steps that lie evenly along a path, its first and last among them."""
    finite = np.flatnonzero(np.isfinite(path).all(axis=1))
    if not len(finite):
        return []
    moved = np.hypot(*np.diff(path[finite], axis=0).T) if len(finite) > 1 else np.zeros(0)
    travelled = np.concatenate([[0.0], np.cumsum(moved)])
    # A lost estimate may jump for kilometres; a thousand ellipses are enough for any map.
    wanted = np.linspace(0.0, travelled[-1], min(1000, 2 + int(travelled[-1] / spacing_m)))
    return sorted({int(finite[min(int(i), len(finite) - 1)]) for i in np.searchsorted(travelled, wanted)})


def _keys(run: RunData, magnification: int) -> tuple[Key, ...]:
    """Return the entries for what is drawn, and nothing else."""
    world, trace = run.world, run.trace
    candidates = (
        (trace.has("true_x_m"), Key("true path", BLUE, "line", "true")),
        (trace.has("est_x_m"), Key("estimated path", VERMILLION, "dash", "estimated")),
        (trace.has("ref_x_m"), Key("reference", GREEN, "line", "reference")),
        (bool(run.plans), Key("first plan", SKY, "band", "plan")),
        (len(run.plans) > 1, Key(f"{_later(run)} ({len(run.plans) - 1})", PURPLE, "band", "replans")),
        (len(run.shortest_path_m) > 1, Key("exact shortest path", BLACK, "dot", "shortest")),
        (any(len(plan.tree) for plan in run.plans), Key("search tree", layers.TREE_COLOUR, "line", "tree")),
        (world.has_obstacles, Key("unexpected obstacles", ORANGE, "band", "obstacles", 1.0)),
        (len(run.mapped_points_m) > 0, Key("obstacle points the robot mapped", BLACK, "spot", "mapped")),
        (bool(world.landmarks), Key("beacons", GREEN, "spot", "beacons")),
        (magnification > 0, Key("95 % ellipses to scale", BLACK, "line", "ellipses")),
        (magnification > 1, Key(f"ellipses magnified {magnification} ×", SKY, "band", "magnified")),
        (
            run.grid is None and len(world.segments_m) + len(world.circles_m) > 0,
            Key("walls", INK, "line", "walls"),
        ),
        (run.grid is not None, Key("grid: occupied", OCCUPIED_COLOUR, "band", "grid", 1.0)),
        (has_unknown(run.grid), Key("grid: unknown", UNKNOWN_COLOUR, "band", opacity=1.0)),
    )
    return tuple(key for there, key in candidates if there)


def _later(run: RunData) -> str:
    """What the plans after the first are called."""
    return "later plans" if len(run.outline.goals) > 1 else "replans"


def _caption(run: RunData, limits: Limits, magnification: int) -> str:
    outline, radius = run.outline, run.outline.radius_m
    parts = ["Numbers are those of the event list. Tick a layer off to see what lies beneath it."]
    ends = run.world.segments_m.reshape(-1, 2)
    if bool(((ends < limits[:2]) | (ends > limits[2:])).any()):
        parts.append("Only the part of the floor around the run is shown.")
    # Where nobody drove there is no end.
    end = run.trace.has("true_x_m")
    if len(outline.polygon_m):
        long, wide = (float(side) for side in np.ptp(outline.polygon_m, axis=0))
        parts.append(
            f"The robot's outline at start (open){', end (filled)' * end} and goal (dashed) is to scale, "
            f"{quantities.length(long)} long and {quantities.length(wide)} wide."
        )
    elif radius is not None:
        parts.append(
            f"The robot's disc at start (open){' and end (filled)' * end} is to scale, "
            f"{quantities.length(radius)} in radius."
        )
    if magnification == 1:
        parts.append("The ellipses hold the true position with 95 % probability, to scale.")
    elif magnification > 1:
        parts.append(
            "The ellipses hold the true position with 95 % probability; to scale they are "
            f"mere specks at this size, so they are also drawn magnified {magnification} times."
        )
    return " ".join(parts)
