"""The map: the world as it was, what the robot planned, believed and did, and where things happened."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pilotage.core.types import FloatArray
from pilotage.report import quantities
from pilotage.report.event_kinds import event_kind
from pilotage.report.figures import layers
from pilotage.report.figures.badge import RADIUS_PT, badge
from pilotage.report.figures.placing import LabelPlacer, along
from pilotage.report.run_folder import RunData
from pilotage.report.style import (
    BLACK,
    BLUE,
    GREEN,
    INK,
    MUTED,
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

SLUG = "map"
TITLE = "The map"

Limits: TypeAlias = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in metres."""

_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT = 34.0, 6.0, 6.0, 30.0
_MOST_HEIGHT_PT, _LEAST_HEIGHT_PT = 900.0, 150.0
_MOST_BEACON_LABELS = 150
# A run that needs less than this share of the floor is shown with its surroundings only.
_SMALL_PART = 0.55
_MAGNIFICATIONS = (1000, 500, 200, 100, 50, 20, 10, 5, 2)


def map_figure(run: RunData) -> Illustration:
    """Draw the whole run on its map, to scale, every layer switchable."""
    limits = view_limits(run)
    if limits is None:
        return Illustration(SLUG, TITLE, "", "The run recorded neither a map nor a path.")
    figure, axes, points_per_m = _map_axes(limits)
    world = run.world
    placer = _placer(run, axes, points_per_m)

    layers.draw_tree(axes, run)
    layers.draw_plans(axes, run)
    layers.draw_obstacles(axes, world)
    layers.draw_walls(axes, world)
    # A cell of a third of a millimetre on the page: closer points are one dot.
    layers.draw_mapped_points(axes, run, max(0.04, 1.6 / points_per_m))
    layers.draw_shortest(axes, run)
    layers.draw_paths(axes, run)
    magnification = _draw_ellipses(axes, run, max(limits[2] - limits[0], limits[3] - limits[1]))
    _draw_robot(axes, run, placer, points_per_m)
    _draw_events(axes, run, placer, points_per_m)
    _draw_beacons(axes, run, placer, points_per_m)

    caption = _caption(run, limits, magnification)
    alt = f"Map of the run {run.name} with walls, planned, true and estimated path and the places of events"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), _keys(run, magnification))


def view_limits(run: RunData) -> Limits | None:
    """Return what the map shows; None where there is nothing to show.

    That is the whole world, or only the run's surroundings where the run keeps to a small part of it.
    """
    whole = _extent(_world_points(run), 0.015, 0.3)
    world = run.world
    ends = [pose[:2] for pose in (world.start, world.goal) if pose is not None]
    visited = [
        layers.true_path(run),
        *(plan.path[:, :2] for plan in run.plans),
        np.array(ends).reshape(-1, 2),
    ]
    near = _extent(np.concatenate(visited), 0.6, 10.0 * (world.robot_radius_m or 0.3))
    if whole is None:
        # A lost estimate may be anywhere, so it only counts where nothing else does.
        return near or _extent(layers.estimated_path(run), 0.1, 1.0)
    if near is None:
        return whole
    side = max(near[2] - near[0], near[3] - near[1])
    if side > _SMALL_PART * min(whole[2] - whole[0], whole[3] - whole[1]):
        return whole
    x, y = 0.5 * (near[0] + near[2]), 0.5 * (near[1] + near[3])
    return x - 0.5 * side, y - 0.5 * side, x + 0.5 * side, y + 0.5 * side


def _world_points(run: RunData) -> FloatArray:
    """(n, 2) points that span the world and everything that truly happened in it."""
    world = run.world
    discs = [discs for discs in (world.circles_m, world.obstacle_circles_m) if len(discs)]
    parts = [
        world.segments_m.reshape(-1, 2),
        world.obstacle_segments_m.reshape(-1, 2),
        *world.obstacle_polygons_m,
        *(disc[:, :2] + side * disc[:, 2:] for disc in discs for side in (-1.0, 1.0)),
        np.array([(landmark.x_m, landmark.y_m) for landmark in world.landmarks]).reshape(-1, 2),
    ]
    if world.bounds_m is not None:
        parts.append(np.array(world.bounds_m).reshape(2, 2))
    if sum(len(part) for part in parts):
        parts += [layers.true_path(run), *(plan.path[:, :2] for plan in run.plans)]
    return np.concatenate(parts)


def _extent(points: FloatArray, relative: float, least_m: float) -> Limits | None:
    """Return the limits of the finite points with a margin, in parts of their size and at least in metres."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return None
    (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
    margin = max(relative * max(x_max - x_min, y_max - y_min), least_m)
    return float(x_min - margin), float(y_min - margin), float(x_max + margin), float(y_max + margin)


def place_at(run: RunData, t_s: float) -> tuple[float, float] | None:
    """Return where the robot truly was at a time, or where it believed to be, or None."""
    if not run.trace.steps or not math.isfinite(t_s):
        return None
    step = min(int(np.searchsorted(run.trace.t_s, t_s)), run.trace.steps - 1)
    for path in (layers.true_path(run), layers.estimated_path(run)):
        if bool(np.isfinite(path[step]).all()):
            return float(path[step, 0]), float(path[step, 1])
    return None


def _map_axes(limits: Limits) -> tuple[Figure, Axes, float]:
    """Return a figure whose axes have equal scales and fill it, and its points a metre."""
    x_min, y_min, x_max, y_max = limits
    width = WIDTH_PT - _LEFT_PT - _RIGHT_PT
    scale = min(width / (x_max - x_min), _MOST_HEIGHT_PT / (y_max - y_min))
    height = max(scale * (y_max - y_min), _LEAST_HEIGHT_PT)
    # What is too tall or too flat for the page gets room at its sides instead of a distortion.
    x_margin, y_margin = 0.5 * (width / scale - (x_max - x_min)), 0.5 * (height / scale - (y_max - y_min))
    total = height + _TOP_PT + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    axes = figure.add_axes((_LEFT_PT / WIDTH_PT, _BOTTOM_PT / total, width / WIDTH_PT, height / total))
    axes.set_xlim(x_min - x_margin, x_max + x_margin)
    axes.set_ylim(y_min - y_margin, y_max + y_margin)
    axes.set_autoscale_on(False)
    axes.set_xlabel("x [m]", labelpad=2.0)
    axes.set_ylabel("y [m]", labelpad=2.0)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.tick_params(length=0.0)
    return figure, axes, scale


def _placer(run: RunData, axes: Axes, points_per_m: float) -> LabelPlacer:
    """Return a placer that knows the walls and paths; it works in points from the map's origin."""
    world, spacing = run.world, 4.0 / points_per_m
    parts = [
        along(run_path[:: max(1, len(run_path) // 2000)], spacing, 1.0)
        for run_path in (layers.true_path(run),)
    ]
    parts += [along(plan.path[:, :2], 2.0 * spacing, 0.3) for plan in run.plans]
    parts.append(along(run.shortest_path_m, spacing, 0.3))
    parts += [along(ends.reshape(2, 2), spacing, 1.5) for ends in world.segments_m[:400]]
    parts += [along(polygon, spacing, 2.0) for polygon in world.obstacle_polygons_m]
    occupied = np.concatenate(parts)
    occupied[:, :2] *= points_per_m
    (x_min, x_max), (y_min, y_max) = axes.get_xlim(), axes.get_ylim()
    return LabelPlacer(
        occupied, (x_min * points_per_m, y_min * points_per_m, x_max * points_per_m, y_max * points_per_m)
    )


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


def _draw_robot(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
    """Draw the robot at its start and end, the goal, and write what is what."""
    world, trace = run.world, run.trace
    radius = world.robot_radius_m or 0.0
    path = layers.true_path(run)
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    names: list[tuple[str, float, float]] = []
    start = world.start
    if start is None and len(known):
        first = int(known[0])
        start = (float(path[first, 0]), float(path[first, 1]), float(trace["true_theta_rad"][first]))
    if start is not None:
        layers.draw_body(axes, *start, radius, BLUE, filled=False)
        names.append(("start", start[0], start[1]))
    if world.goal is not None:
        x, y, theta = world.goal
        axes.plot([x], [y], marker="X", color=GREEN, markersize=9.0, markeredgecolor="white", zorder=9.5)
        if theta is not None:
            reach = max(2.0 * radius, 14.0 / points_per_m)
            tip = np.array([(x, y), (x + reach * math.cos(theta), y + reach * math.sin(theta))])
            layers.line(axes, tip, "body", color=GREEN, linewidth=1.4, zorder=9.4)
        names.append(("goal", x, y))
    if len(known):
        last = int(known[-1])
        x, y = float(path[last, 0]), float(path[last, 1])
        layers.draw_body(axes, x, y, float(trace["true_theta_rad"][last]), radius, BLUE)
        near_goal = world.goal is not None and math.hypot(x - world.goal[0], y - world.goal[1]) < 1.0
        if not near_goal and len(known) > 1:
            names.append(("end", x, y))
    gap = radius * points_per_m + 3.0
    for text, x, y in names:
        place = placer.place(
            x * points_per_m, y * points_per_m, 13.0, 5.5, gap + np.array([0.0, 5.0, 12.0, 22.0])
        )
        axes.text(
            place[0] / points_per_m,
            place[1] / points_per_m,
            text,
            ha="center",
            va="center_baseline",
            fontweight="bold",
            fontsize=9.0,
            zorder=22,
        )


def _draw_events(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
    """Mark where events happened; those at one place share a badge."""
    clusters: list[tuple[float, float, list[int], str]] = []
    for index, event in enumerate(run.events, start=1):
        kind = event_kind(event.kind)
        place = place_at(run, event.t_s) if kind.on_map else None
        if place is None:
            continue
        x, y = place[0] * points_per_m, place[1] * points_per_m
        near = next(
            (c for c in clusters if math.hypot(c[0] - x, c[1] - y) < 7.0 and c[3] == kind.colour), None
        )
        if near is None:
            clusters.append((x, y, [index], kind.colour))
        else:
            near[2].append(index)
    for x, y, numbers, colour in clusters:
        text = _ranges(numbers)
        half_width = RADIUS_PT if len(text) <= 2 else 2.6 * len(text)
        reach = np.array([9.0, 15.0, 22.0, 32.0, 45.0])
        badge_x, badge_y = placer.place(x, y, half_width + 1.0, RADIUS_PT + 1.0, reach)
        leader = np.array([(x, y), (badge_x, badge_y)]) / points_per_m
        layers.line(axes, leader, "events", color=colour, linewidth=0.8, zorder=18)
        axes.plot(*leader[:1].T, "o", color=colour, markersize=4.0, markeredgecolor="white", zorder=19)
        badge(axes, badge_x / points_per_m, badge_y / points_per_m, text, colour)


def _ranges(numbers: list[int]) -> str:
    """Write numbers short: 3–5, 9; only the first and the last where there are many."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = [str(part[0]) if len(part) == 1 else f"{part[0]}–{part[-1]}" for part in runs]
    return ", ".join(texts) if len(texts) <= 3 else f"{texts[0]} … {texts[-1]}"


def _draw_beacons(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
    """Draw the beacons, their identity readable but discreet."""
    (x_min, x_max), (y_min, y_max) = axes.get_xlim(), axes.get_ylim()
    # Markers end at the map's rim, but words would run on over the page.
    landmarks = [
        mark for mark in run.world.landmarks if x_min < mark.x_m < x_max and y_min < mark.y_m < y_max
    ]
    if not landmarks:
        return
    xs, ys = [landmark.x_m for landmark in landmarks], [landmark.y_m for landmark in landmarks]
    (marks,) = axes.plot(
        xs,
        ys,
        linestyle="none",
        marker="D",
        markersize=4.2,
        color=GREEN,
        markeredgecolor="white",
        markeredgewidth=0.5,
        zorder=8.2,
    )
    marks.set_gid("layer-beacons")
    if len(landmarks) > _MOST_BEACON_LABELS:
        return
    for landmark in landmarks:
        place = placer.place(
            landmark.x_m * points_per_m,
            landmark.y_m * points_per_m,
            2.2 * len(landmark.id),
            3.2,
            np.array([3.0, 5.0, 8.0]),
        )
        label = axes.text(
            place[0] / points_per_m,
            place[1] / points_per_m,
            landmark.id,
            ha="center",
            va="center_baseline",
            fontsize=7.0,
            color=MUTED,
            zorder=8.3,
        )
        label.set_gid("layer-beacons")


def _keys(run: RunData, magnification: int) -> tuple[Key, ...]:
    """Return the entries for what is drawn, and nothing else."""
    world, trace = run.world, run.trace
    candidates = (
        (trace.has("true_x_m"), Key("true path", BLUE, "line", "true")),
        (trace.has("est_x_m"), Key("estimated path", VERMILLION, "dash", "estimated")),
        (trace.has("ref_x_m"), Key("reference", GREEN, "line", "reference")),
        (bool(run.plans), Key("first plan", SKY, "band", "plan")),
        (len(run.plans) > 1, Key(f"replans ({len(run.plans) - 1})", PURPLE, "band", "replans")),
        (len(run.shortest_path_m) > 1, Key("exact shortest path", BLACK, "dot", "shortest")),
        (any(len(plan.tree) for plan in run.plans), Key("search tree", layers.TREE_COLOUR, "line", "tree")),
        (world.has_obstacles, Key("unexpected obstacles", ORANGE, "band", "obstacles", 1.0)),
        (len(run.mapped_points_m) > 0, Key("obstacle points the robot mapped", BLACK, "spot", "mapped")),
        (bool(world.landmarks), Key("beacons", GREEN, "spot", "beacons")),
        (magnification > 0, Key("95 % ellipses to scale", BLACK, "line", "ellipses")),
        (magnification > 1, Key(f"ellipses magnified {magnification} ×", SKY, "band", "magnified")),
        (len(world.segments_m) > 0, Key("walls", INK, "line", "walls")),
    )
    return tuple(key for there, key in candidates if there)


def _caption(run: RunData, limits: Limits, magnification: int) -> str:
    radius = run.world.robot_radius_m
    parts = ["Numbers are those of the event list. Tick a layer off to see what lies beneath it."]
    ends = run.world.segments_m.reshape(-1, 2)
    if bool(((ends < limits[:2]) | (ends > limits[2:])).any()):
        parts.append("Only the part of the floor around the run is shown.")
    if radius is not None:
        parts.append(
            "The robot's disc at start (open) and end (filled) is to scale, "
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
