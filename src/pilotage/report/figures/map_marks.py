"""What stands on the map by name: robot, start, goal, events and beacons, each with room for its words."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from matplotlib.axes import Axes

from pilotage.records.run_data import RunData
from pilotage.report.figures import layers
from pilotage.report.figures.badge import RADIUS_PT, badge
from pilotage.report.figures.event_marks import event_places
from pilotage.report.figures.placing import LabelPlacer, along
from pilotage.report.style import BLUE, GREEN, MUTED

_MOST_BEACON_LABELS = 150


def label_placer(run: RunData, axes: Axes, points_per_m: float) -> LabelPlacer:
    """Return a placer that knows the walls and paths; it works in points from the map's origin."""
    world, spacing = run.world, 4.0 / points_per_m
    true_path = layers.true_path(run)
    parts = [along(true_path[:: max(1, len(true_path) // 2000)], spacing, 1.0)]
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


def draw_robot(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
    """Draw the robot at its start and end, the goal, and write what is what."""
    trace, outline = run.trace, run.outline
    radius, polygon = outline.radius_m or 0.0, outline.polygon_m
    goal = outline.goals[-1] if outline.goals else None
    path = layers.true_path(run)
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    names: list[tuple[str, float, float]] = []
    start = outline.start
    if start is None and len(known):
        first = int(known[0])
        start = (float(path[first, 0]), float(path[first, 1]), float(trace["true_theta_rad"][first]))
    if start is not None:
        layers.draw_body(axes, *start, radius, BLUE, filled=False, polygon_m=polygon)
        names.append(("start", start[0], start[1]))
    for number, (x, y, _) in enumerate(outline.goals[:-1], start=1):
        axes.plot([x], [y], marker="x", color=GREEN, markersize=7.0, markeredgewidth=1.6, zorder=9.5)
        names.append((f"{number}", x, y))
    if goal is not None:
        x, y, theta = goal
        axes.plot([x], [y], marker="X", color=GREEN, markersize=9.0, markeredgecolor="white", zorder=9.5)
        if theta is not None:
            reach = max(2.0 * radius, 14.0 / points_per_m)
            tip = np.array([(x, y), (x + reach * math.cos(theta), y + reach * math.sin(theta))])
            layers.line(axes, tip, "body", color=GREEN, linewidth=1.4, zorder=9.4)
            if len(polygon):
                look = {"facecolor": "none", "linewidth": 1.3, "linestyle": (0, (3, 2)), "zorder": 9.3}
                layers.draw_body(axes, x, y, theta, radius, GREEN, polygon_m=polygon, look=look)
        names.append(("goal", x, y))
    if len(known):
        last = int(known[-1])
        x, y = float(path[last, 0]), float(path[last, 1])
        layers.draw_body(axes, x, y, float(trace["true_theta_rad"][last]), radius, BLUE, polygon_m=polygon)
        near_goal = goal is not None and math.hypot(x - goal[0], y - goal[1]) < 1.0
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


def draw_events(
    axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float, of: Collection[int] | None = None
) -> None:
    """Mark where events happened, all or those ``of`` some indices; those at one place share a badge."""
    for place in event_places(run, points_per_m, of):
        text, x, y = place.text, place.x_m * points_per_m, place.y_m * points_per_m
        half_width = RADIUS_PT if len(text) <= 2 else 2.6 * len(text)
        reach = np.array([9.0, 15.0, 22.0, 32.0, 45.0])
        badge_x, badge_y = placer.place(x, y, half_width + 1.0, RADIUS_PT + 1.0, reach)
        leader = np.array([(x, y), (badge_x, badge_y)]) / points_per_m
        layers.line(axes, leader, "events", color=place.colour, linewidth=0.8, zorder=18)
        axes.plot(*leader[:1].T, "o", color=place.colour, markersize=4.0, markeredgecolor="white", zorder=19)
        badge(axes, badge_x / points_per_m, badge_y / points_per_m, text, place.colour)


def draw_beacons(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
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
