"""The first plan as its planner saw it: waypoints, search tree, and walls grown by what it keeps off them."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.path import Path as Outline

from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.figures import layers
from pilotage.report.figures.grid import draw_grid, draw_grown_grid
from pilotage.report.figures.map_view import map_axes, view_limits
from pilotage.report.style import BLUE, GREEN, INK, SKY, Illustration, Key, one_shape, render

SLUG, TITLE = "plan-picture", "The plan and its waypoints"
GROWN_COLOUR = "#e8d9c3"


def plan_figure(run: RunData) -> Illustration:
    """Draw the first plan; nothing where there is none."""
    limits = view_limits(run)
    if limits is None or not run.plans or len(run.plans[0].waypoints) < 2:
        return Illustration(SLUG, TITLE, "", "")
    plan = run.plans[0]
    figure, axes, points_per_m = map_axes(limits)
    grown = math.isfinite(plan.clearance_m) and plan.clearance_m > 0.0
    if grown:
        _draw_grown(axes, run, plan.clearance_m, points_per_m)
    if run.grid is None:
        layers.draw_walls(axes, run.world)
    else:
        draw_grid(axes, run.grid)
    edges = plan.tree[: layers.MOST_TREE_EDGES, :4]
    if len(edges):
        layers.segments(axes, edges, "plan-tree", color=layers.TREE_COLOUR, linewidth=0.5, zorder=5.5)
    _draw_outlines(axes, run)
    layers.line(axes, plan.path[:, :2], "planned", color=SKY, linewidth=2.4, zorder=6)
    x, y = plan.waypoints[:, 0], plan.waypoints[:, 1]
    axes.plot(x, y, "o", color=BLUE, markersize=4.0, zorder=7, gid="layer-waypoints")
    axes.plot(x[:1], y[:1], "o", color="white", markeredgecolor=BLUE, markersize=8.0, zorder=7.5)
    axes.plot(x[-1:], y[-1:], "X", color=GREEN, markeredgecolor="white", markersize=10.0, zorder=7.5)
    alt = f"Plan of the run {run.name}: path, {len(x)} waypoints, and walls grown by the planner's clearance"
    return Illustration(SLUG, TITLE, alt, _caption(run, grown), render(figure, SLUG, alt), _keys(run, grown))


def _draw_grown(axes: Axes, run: RunData, clearance_m: float, points_per_m: float) -> None:
    """Everything that the planner's point must not come into; to scale."""
    world = run.world
    if run.grid is not None:
        draw_grown_grid(axes, run.grid, clearance_m, GROWN_COLOUR)
        return
    wide = 2.0 * clearance_m * points_per_m
    layers.segments(axes, world.segments_m, "grown", color=GROWN_COLOUR, linewidth=wide, zorder=1.0)
    discs = world.circles_m.copy()
    if len(discs):
        discs[:, 2] += clearance_m
        layers.circles(axes, discs, "grown", facecolor=GROWN_COLOUR, edgecolor=GROWN_COLOUR, zorder=1.0)


def _draw_outlines(axes: Axes, run: RunData) -> None:
    """A polygon at the waypoints, where these have headings: whether it fits is seen."""
    polygon, waypoints = run.outline.polygon_m, run.plans[0].waypoints
    if not len(polygon) or waypoints.shape[1] < 3:
        return
    shapes = [layers.body_outline(x, y, theta, 0.0, polygon) for x, y, theta in waypoints]
    rims = [Outline(shape, closed=True) for shape in shapes]
    look: dict[str, Any] = {"facecolor": SKY, "edgecolor": BLUE, "linewidth": 0.5, "alpha": 0.25}
    one_shape(axes, rims, gid="layer-outlines", zorder=5.8, **look)


def _caption(run: RunData, grown: bool) -> str:
    plan = run.plans[0]
    text = f"{len(plan.waypoints)} waypoints on {quantities.length(plan.length_m)}"
    if not grown:
        return f"{text}."
    radius, kept = run.outline.radius_m or 0.0, quantities.length(plan.clearance_m)
    if len(run.outline.polygon_m) or plan.clearance_m < radius:
        seen = f"Walls are drawn grown by the {kept} that the planner keeps"
    else:
        spare = ", and room to spare" if plan.clearance_m > radius + 0.005 else ""
        body = f": the body's radius of {quantities.length(radius)}{spare}" if radius else ""
        seen = (
            f"The planner moves a point; walls are drawn as it sees them, grown by the {kept} it keeps{body}"
        )
    return f"{text}. {seen}. What is on no map is not drawn."


def _keys(run: RunData, grown: bool) -> tuple[Key, ...]:
    candidates = (
        (True, Key("planned path", SKY, "line", "planned")),
        (True, Key("waypoints", BLUE, "spot", "waypoints")),
        (len(run.outline.polygon_m) > 0, Key("outline there", SKY, "band", "outlines", 0.25)),
        (len(run.plans[0].tree) > 0, Key("search tree", layers.TREE_COLOUR, "line", "plan-tree")),
        (grown, Key("walls, grown", GROWN_COLOUR, "band", "grown", 1.0)),
        (run.grid is None and len(run.world.segments_m) > 0, Key("walls", INK, "line", "walls")),
    )
    return tuple(key for there, key in candidates if there)
