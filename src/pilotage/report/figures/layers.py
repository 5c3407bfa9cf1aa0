"""The layers of a map: walls, beacons, obstacles, plans, paths, ellipses, the robot's body.

Each is one path element with a name, so that the page stays small and can switch it on and off.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path as Outline

from pilotage.core.types import FloatArray, Pose2
from pilotage.records.run_data import RunData
from pilotage.records.world import World
from pilotage.report.style import (
    BLACK,
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    one_shape,
)

ELLIPSE_PROBABILITY = 0.95
# Chi-square quantile of two degrees of freedom in closed form.
_ELLIPSE_RADIUS = math.sqrt(-2.0 * math.log(1.0 - ELLIPSE_PROBABILITY))
TREE_COLOUR = "#b4bec9"
OBSTACLE_EDGE = "#7a5400"
# A tree of more edges is a grey cloud; its first edges show its shape just as well.
MOST_TREE_EDGES = 5000
PEOPLE_COLOUR = GREEN
_CIRCLE = np.stack([np.cos(np.linspace(0, 2 * np.pi, 33)), np.sin(np.linspace(0, 2 * np.pi, 33))])


def true_path(run: RunData) -> FloatArray:
    """(N, 2) where the robot was."""
    return np.stack([run.trace["true_x_m"], run.trace["true_y_m"]], axis=1)


def estimated_path(run: RunData) -> FloatArray:
    """(N, 2) where it believed to be."""
    return np.stack([run.trace["est_x_m"], run.trace["est_y_m"]], axis=1)


def draw_walls(axes: Axes, world: World, linewidth: float = 1.5) -> None:
    """Draw the known walls and pillars."""
    segments(axes, world.segments_m, "walls", color=INK, linewidth=linewidth, zorder=5)
    circles(axes, world.circles_m, "walls", facecolor="#c5ccd3", edgecolor=INK, linewidth=linewidth, zorder=5)


def draw_obstacles(axes: Axes, world: World) -> None:
    """Draw what the robot was not told about, filled."""
    look: dict[str, Any] = {"facecolor": ORANGE, "edgecolor": OBSTACLE_EDGE, "linewidth": 0.8, "zorder": 5.2}
    polygons = [
        Outline(np.vstack([polygon, polygon[:1]]), closed=True) for polygon in world.obstacle_polygons_m
    ]
    one_shape(axes, polygons, gid="layer-obstacles", **look)
    circles(axes, world.obstacle_circles_m, "obstacles", **look)
    segments(axes, world.obstacle_segments_m, "obstacles", color=OBSTACLE_EDGE, linewidth=1.2, zorder=5.1)


def draw_people(axes: Axes, run: RunData, t_s: float, half_m: float, x: float, y: float) -> None:
    """Draw whoever was in a square about a place at a time."""
    places = run.people.at(np.array([t_s]))[0]
    discs = np.column_stack([places, run.people.radius_m])
    there = np.abs(places - (x, y)).max(axis=1, initial=0.0) < half_m
    circles(axes, discs[there], "people", facecolor=PEOPLE_COLOUR, edgecolor=INK, linewidth=0.8, zorder=8.8)


def draw_tree(axes: Axes, run: RunData) -> None:
    """Draw the planner's search trees, thin and light."""
    trees = [plan.tree[:, :4] for plan in run.plans if len(plan.tree)]
    if trees:
        share = MOST_TREE_EDGES // len(trees)
        edges = np.concatenate([tree[:share] for tree in trees])
        segments(axes, edges, "tree", color=TREE_COLOUR, linewidth=0.45, zorder=1)


def draw_plans(axes: Axes, run: RunData, linewidth: float = 4.5) -> None:
    """Draw the planned paths as broad bands under the driven ones: the first, then what replaced it."""
    # All replans as one line with gaps: thirty translucent ones on each other would be one solid bar.
    gap = np.full((1, 2), np.nan)
    first = [plan.path[:, :2] for plan in run.plans[:1]]
    later = [part for plan in run.plans[1:] for part in (plan.path[:, :2], gap)]
    for layer, parts, colour, zorder in (("plan", first, SKY, 2.0), ("replans", later, PURPLE, 2.1)):
        if parts:
            together = np.concatenate(parts)
            line(axes, together, layer, color=colour, linewidth=linewidth, alpha=0.45, zorder=zorder)


def draw_paths(axes: Axes, run: RunData, linewidth: float = 2.2) -> None:
    """Draw reference, true and estimated path; the truth is broad so that the estimate on it is seen."""
    trace = run.trace
    reference = np.stack([trace["ref_x_m"], trace["ref_y_m"]], axis=1)
    line(axes, _without_jumps(reference), "reference", color=GREEN, linewidth=0.9, zorder=6)
    line(axes, _cut_where_carried(run, true_path(run)), "true", color=BLUE, linewidth=linewidth, zorder=7)
    line(
        axes,
        _cut_where_carried(run, estimated_path(run)),
        "estimated",
        color=VERMILLION,
        linewidth=0.45 * linewidth,
        linestyle=(0, (4.0, 2.5)),
        zorder=8,
    )


def draw_shortest(axes: Axes, run: RunData) -> None:
    """Draw the exact shortest path."""
    line(
        axes,
        run.shortest_path_m,
        "shortest",
        color=BLACK,
        linewidth=1.1,
        linestyle=(0, (1.0, 2.2)),
        dash_capstyle="round",
        zorder=6.5,
    )


def draw_mapped_points(axes: Axes, run: RunData, size_m: float) -> None:
    """Draw the obstacle points that the robot put on its own map, one in each cell of ``size_m``."""
    points = run.mapped_points_m[:, :2]
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return
    _, kept = np.unique(np.floor(points / size_m).astype(np.int64), axis=0, return_index=True)
    # Smaller than its cell, so that what was mapped and what is there can both be seen.
    half = 0.3 * size_m
    squares = [
        Outline(
            [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half), (x, y)],
            closed=True,
        )
        for x, y in points[np.sort(kept)]
    ]
    one_shape(axes, squares, facecolor=BLACK, zorder=5.4, gid="layer-mapped")


def ellipse_outlines(run: RunData, steps: Iterable[int], magnification: float = 1.0) -> list[Outline]:
    """Return the 95 % ellipses of the estimated position at some steps."""
    trace = run.trace
    columns = [trace[name] for name in ("est_x_m", "est_y_m", "cov_xx_m2", "cov_xy_m2", "cov_yy_m2")]
    outlines = []
    for step in steps:
        x, y, xx, xy, yy = (float(column[step]) for column in columns)
        if not math.isfinite(x + y + xx + xy + yy):
            continue
        values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
        axes_m = magnification * _ELLIPSE_RADIUS * np.sqrt(np.maximum(values, 0.0))
        rim = vectors @ (axes_m[:, None] * _CIRCLE)
        outlines.append(Outline(rim.T + np.array([x, y]), closed=True))
    return outlines


def semi_axis(run: RunData) -> FloatArray:
    """(N,) greater half axis of each step's 95 % ellipse."""
    xx, xy, yy = (run.trace[name] for name in ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2"))
    greatest = 0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)
    return np.asarray(_ELLIPSE_RADIUS * np.sqrt(np.maximum(greatest, 0.0)))


def draw_body(
    axes: Axes,
    x: float,
    y: float,
    theta: float | None,
    radius_m: float,
    colour: str,
    filled: bool = True,
    opacity: float = 0.75,
    polygon_m: FloatArray | None = None,
    look: Mapping[str, Any] | None = None,
) -> None:
    """Draw the robot's disc or polygon to scale, with a stroke from its origin to where it looks.

    A polygon needs a heading; where that is unknown the circle around it is drawn.
    """
    if not math.isfinite(x + y):
        return
    rim = body_outline(x, y, theta, radius_m, polygon_m)
    face = colour if filled else "white"
    one_shape(
        axes,
        [Outline(rim, closed=True)],
        **{
            "facecolor": face,
            "edgecolor": colour,
            "linewidth": 1.0,
            "alpha": opacity,
            "zorder": 9,
            "gid": "layer-body",
            **(look or {}),
        },
    )
    if look is None and theta is not None and math.isfinite(theta):
        ahead_m = radius_m if polygon_m is None or not len(polygon_m) else float(polygon_m[:, 0].max())
        tip = (x + ahead_m * math.cos(theta), y + ahead_m * math.sin(theta))
        stroke = "white" if filled else colour
        line(axes, np.array([(x, y), tip]), "body", color=stroke, linewidth=1.0, zorder=9.1)


def body_outline(
    x: float, y: float, theta: float | None, radius_m: float, polygon_m: FloatArray | None = None
) -> FloatArray:
    """(n, 2) closed rim of a body at a pose."""
    if polygon_m is None or not len(polygon_m) or theta is None or not math.isfinite(theta):
        return np.asarray((radius_m * _CIRCLE).T + np.array([x, y]))
    placed = Pose2(x, y, theta).placed(polygon_m)
    return np.vstack([placed, placed[:1]])


def line(axes: Axes, points: FloatArray, layer: str, **look: Any) -> None:
    """Draw one polyline as a named layer; NaN points are gaps."""
    if len(points) and bool(np.isfinite(points).all(axis=1).any()):
        (drawn,) = axes.plot(points[:, 0], points[:, 1], **look)
        drawn.set_gid(f"layer-{layer}")


def segments(axes: Axes, ends: FloatArray, layer: str, color: str, linewidth: float, zorder: float) -> None:
    """Draw (n, 4) segments as one path element."""
    ends = ends[np.isfinite(ends).all(axis=1)]
    if not len(ends):
        return
    codes = np.tile(np.array([Outline.MOVETO, Outline.LINETO], dtype=np.uint8), len(ends))
    one_shape(
        axes,
        [Outline(ends.reshape(-1, 2), codes)],
        facecolor="none",
        edgecolor=color,
        linewidth=linewidth,
        capstyle="round",
        zorder=zorder,
        gid=f"layer-{layer}",
    )


def circles(axes: Axes, discs: FloatArray, layer: str, **look: Any) -> None:
    """Draw (n, 3) discs (x, y, radius) as one path element."""
    outlines = [
        Outline((radius * _CIRCLE).T + np.array([x, y]), closed=True)
        for x, y, radius in discs
        if math.isfinite(x + y + radius)
    ]
    one_shape(axes, outlines, gid=f"layer-{layer}", **look)


def _cut_where_carried(run: RunData, points: FloatArray) -> FloatArray:
    """Break a path where the robot was carried elsewhere: it did not drive there."""
    carried = [event.t_s for event in run.events if event.kind == "kidnap" and math.isfinite(event.t_s)]
    steps = np.searchsorted(run.trace.t_s, np.array(carried) + 1e-9)
    return np.insert(points, steps[(steps > 0) & (steps < len(points))], np.nan, axis=0)


def _without_jumps(points: FloatArray) -> FloatArray:
    """Break the reference where it jumps: a replan starts it anew somewhere else."""
    if len(points) < 3:
        return points
    steps = np.hypot(*np.diff(points, axis=0).T)
    usual = np.nanmedian(steps) if bool(np.isfinite(steps).any()) else 0.0
    broken = points.copy()
    broken[1:][steps > max(10.0 * usual, 0.5)] = np.nan
    return broken
