"""Close-ups of the places that matter most: the map's lines lie on each other, here they come apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pilotage.core.types import BoolArray, FloatArray
from pilotage.records.plans import Plan
from pilotage.records.run_data import RunData
from pilotage.records.trace import Trace
from pilotage.records.world import World
from pilotage.report import quantities
from pilotage.report.event_kinds import event_kind
from pilotage.report.figures import layers
from pilotage.report.figures.grid import draw_grid
from pilotage.report.figures.map_view import drawable_m
from pilotage.report.light_axes import LightAxes
from pilotage.report.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH_PT,
    Illustration,
    Key,
    one_shape,
    render,
)

SLUG = "close-ups"
TITLE = "Close-ups"
MOST = 3
PATH_S = 30.0
LEAST_ROWS = 10
_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT, _GAP_PT = 24.0, 10.0, 20.0, 22.0, 28.0
# What went wrong is worth more than what went well.
_SHOWN_EVENTS = ("collision", "failed", "stuck", "escape", "avoid-start", "replan", "hall")


@dataclass(frozen=True, slots=True)
class Moment:
    """A step worth a closer look, why, and how far off the belief is: the window holds it."""

    step: int
    title: str
    error_m: float = 0.0


def close_ups_figure(run: RunData) -> Illustration:
    """Draw up to three windows around the most telling event, the worst error and the least clearance."""
    path = layers.true_path(run)
    moments = _moments(run, path)
    if not moments:
        return Illustration(SLUG, TITLE, "", "The run recorded no true path to look at closely.")
    radius = run.outline.radius_m or 0.3
    places = path[[moment.step for moment in moments]][:, :2]
    least_m = drawable_m(6.0 * (run.outline.half_length_m or 0.3), places)
    # Coordinates of four digits need room.
    digits_pt = 14.0 if np.abs(places).max() >= 1000.0 else 0.0
    left_pt, right_pt, gap_pt = _LEFT_PT + digits_pt, _RIGHT_PT + 0.5 * digits_pt, _GAP_PT + digits_pt
    side = (WIDTH_PT - left_pt - right_pt - (MOST - 1) * gap_pt) / MOST
    total = side + _TOP_PT + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    for index, moment in enumerate(moments):
        left = left_pt + index * (side + gap_pt)
        axes = figure.add_axes(
            (left / WIDTH_PT, _BOTTOM_PT / total, side / WIDTH_PT, side / total), axes_class=LightAxes
        )
        x, y = (float(value) for value in path[moment.step])
        half_m = max(least_m, 1.3 * moment.error_m)
        axes.set_xlim(x - half_m, x + half_m)
        axes.set_ylim(y - half_m, y + half_m)
        axes.set_autoscale_on(False)
        axes.tick_params(length=0.0)
        axes.set_title(moment.title, fontsize=9.0)
        axes.locator_params(nbins=5)
        _draw(axes, _window(run, x, y, half_m, moment.step), run, moment.step, radius)
        layers.draw_people(axes, run, float(run.trace.t_s[moment.step]), half_m, x, y)
    sides = [quantities.length(2.0 * max(least_m, 1.3 * moment.error_m)) for moment in moments]
    caption = (
        f"{'Windows' if len(sides) > 1 else 'A window'} of {' and '.join(dict.fromkeys(sides))}, in metres "
        "like the map, "
        f"with the path of {PATH_S:g} s before and after. The body is the robot at that moment, dashed is "
        "where it believed to be; the small black ellipses hold it with 95 % probability and are to scale."
    )
    candidates = (
        (True, Key("true path", BLUE)),
        (run.trace.has("est_x_m"), Key("estimated path", VERMILLION, "dash")),
        (run.trace.has("ref_x_m"), Key("reference", GREEN)),
        (bool(run.plans), Key("first plan", SKY, "band")),
        (len(run.plans) > 1, Key("replans", PURPLE, "band")),
        (run.world.has_obstacles, Key("unexpected obstacle", ORANGE, "band", opacity=1.0)),
        (len(run.people.t_s) > 0, Key("people at that moment", layers.PEOPLE_COLOUR, "spot")),
        (len(run.mapped_points_m) > 0, Key("mapped by the robot", BLACK, "spot")),
    )
    keys = tuple(key for there, key in candidates if there)
    alt = "Close-ups of the map: " + "; ".join(moment.title for moment in moments)
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _moments(run: RunData, path: FloatArray) -> list[Moment]:
    """Return the moments worth a look, at most one in a window."""
    known = np.isfinite(path[:, 0] + path[:, 1])
    if not bool(known.any()):
        return []
    trace = run.trace
    found: list[Moment] = []
    kinds = {event.kind for event in run.events}
    telling = next((kind for kind in _SHOWN_EVENTS if kind in kinds), None)
    for number, event in enumerate(run.events, start=1):
        if event.kind == telling and math.isfinite(event.t_s):
            step = min(int(np.searchsorted(trace.t_s, event.t_s)), trace.steps - 1)
            found.append(Moment(step, f"{event_kind(event.kind).name} ({number})"))
            break
    dx, dy = np.transpose(layers.estimated_path(run) - path)
    error = np.where(run.settled(), np.hypot(dx, dy), np.nan)
    if bool(np.isfinite(error).any()):
        step = int(np.nanargmax(error))
        found.append(Moment(step, f"worst error, {quantities.length(float(error[step]))}"))
    clearance = trace["clearance_m"]
    if bool(np.isfinite(clearance).any()):
        step = int(np.nanargmin(clearance))
        found.append(Moment(step, f"least clearance, {quantities.length(float(clearance[step]))}"))
    found.append(Moment(int(np.flatnonzero(known)[-1]), "the end"))
    apart: list[Moment] = []
    for moment in found:
        if known[moment.step] and all(
            math.dist(path[moment.step], path[other.step]) > 1.0 for other in apart
        ):
            off_m = float(np.nan_to_num(error[moment.step]))
            apart.append(
                Moment(moment.step, f"{moment.title}, at {quantities.moment(trace.t_s[moment.step])}", off_m)
            )
    return apart[:MOST]


def _draw(axes: Axes, inside: RunData, run: RunData, step: int, radius: float) -> None:
    """Draw what lies inside the window, and the robot of one step."""
    layers.draw_plans(axes, inside, linewidth=9.0)
    layers.draw_obstacles(axes, inside.world)
    if run.grid is None:
        layers.draw_walls(axes, inside.world, linewidth=2.0)
    else:
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        draw_grid(axes, run.grid, (x0, y0, x1, y1))
    layers.draw_mapped_points(axes, inside, 0.05)
    trace = run.trace
    layers.draw_body(
        axes,
        float(trace["true_x_m"][step]),
        float(trace["true_y_m"][step]),
        float(trace["true_theta_rad"][step]),
        radius,
        BLUE,
        opacity=0.3,
        polygon_m=run.outline.polygon_m,
    )
    layers.draw_paths(axes, inside, linewidth=2.6)
    x, y, theta = (float(trace[f"est_{name}"][step]) for name in ("x_m", "y_m", "theta_rad"))
    look = {"facecolor": "none", "linewidth": 1.2, "linestyle": (0, (3, 2)), "alpha": 1.0}
    layers.draw_body(axes, x, y, theta, radius, VERMILLION, polygon_m=run.outline.polygon_m, look=look)
    known = np.flatnonzero(np.isfinite(layers.estimated_path(inside)).all(axis=1))
    shown = sorted({step, *(int(k) for k in known[:: max(1, len(known) // 12)])})
    one_shape(
        axes,
        layers.ellipse_outlines(run, shown),
        facecolor="none",
        edgecolor=BLACK,
        linewidth=0.6,
        zorder=8.5,
    )
    landmarks = inside.world.landmarks
    xs, ys = [landmark.x_m for landmark in landmarks], [landmark.y_m for landmark in landmarks]
    axes.plot(xs, ys, "D", markersize=5.5, color=GREEN, markeredgecolor="white", zorder=8.2)


def _window(run: RunData, x: float, y: float, half_m: float, step: int) -> RunData:
    """Return the run with only what lies in a window: lines are cut at its rim to keep the page small.

    Of the paths only those of `PATH_S` around the moment: a robot that passes often would fill the window.
    A recording of a row a day still has some rows.
    """
    soon = np.abs(run.trace.t_s - run.trace.t_s[step]) <= PATH_S
    soon[max(step - LEAST_ROWS, 0) : step + LEAST_ROWS + 1] = True

    def near(points: FloatArray) -> BoolArray:
        # A little more than the window, so that lines leave it instead of ending at its rim.
        return np.asarray(np.abs(points[:, :2] - np.array([x, y])).max(axis=1) < 1.3 * half_m)

    def meets(segments: FloatArray) -> FloatArray:
        centre, reach = np.array([x, y]), 1.1 * half_m
        low = np.minimum(segments[:, :2], segments[:, 2:]) <= centre + reach
        high = np.maximum(segments[:, :2], segments[:, 2:]) >= centre - reach
        return segments[(low & high).all(axis=1)]

    def cut(columns: Mapping[str, FloatArray], pair: tuple[str, str]) -> dict[str, FloatArray]:
        if not all(name in columns for name in pair):
            return {}
        points = np.stack([columns[name] for name in pair], axis=1)
        inside = near(points) & soon
        return {name: np.where(inside, columns[name], np.nan) for name in pair}

    columns = dict(run.trace.columns)
    for frame in ("true", "est", "ref"):
        columns |= cut(columns, (f"{frame}_x_m", f"{frame}_y_m"))
    world = run.world
    return replace(
        run,
        trace=Trace(columns, run.trace.steps),
        plans=tuple(_cut_plan(plan, near(plan.path)) for plan in run.plans),
        mapped_points_m=run.mapped_points_m[near(run.mapped_points_m)],
        world=World(
            segments_m=meets(world.segments_m),
            circles_m=world.circles_m,
            landmarks=tuple(
                mark for mark in world.landmarks if max(abs(mark.x_m - x), abs(mark.y_m - y)) < half_m
            ),
            obstacle_segments_m=meets(world.obstacle_segments_m),
            obstacle_circles_m=world.obstacle_circles_m,
            obstacle_polygons_m=world.obstacle_polygons_m,
        ),
    )


def _cut_plan(plan: Plan, inside: BoolArray) -> Plan:
    return replace(plan, path=np.where(inside[:, None], plan.path, np.nan))
