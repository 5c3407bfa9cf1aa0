"""What part of the world a map shows, and axes of equal scales for it."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report.figures import layers
from pilotage.report.figures.grid import known_corners
from pilotage.report.light_axes import LightAxes
from pilotage.report.style import TICK_PT, WIDTH_PT

Limits: TypeAlias = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in metres."""

_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT = 34.0, 6.0, 6.0, 30.0
_AXIS_LABEL_PT = 18.5
_DIGIT_EM, _NARROW_EM, _WIDE_EM = 0.64, 0.32, 0.84
"""Widths of a digit, a point and a minus, in the font's size."""
_MOST_HEIGHT_PT, _LEAST_HEIGHT_PT = 900.0, 150.0
# A run that needs less than this share of the floor is shown with its surroundings only.
_SMALL_PART = 0.55
_LEAST_MARGIN_M, _FINEST = 1e-3, 1e-6
"""A body may be as small as one likes; axes whose ends are one number to so many parts cannot be drawn."""


def view_limits(run: RunData) -> Limits | None:
    """Return what the map shows; None where there is nothing to show.

    That is the whole world, or only the run's surroundings where the run keeps to a small part of it.
    """
    whole = _extent(_world_points(run), 0.015, 0.3)
    world = run.world
    ends = [pose[:2] for robot in world.robots for pose in (robot.start, *robot.goals) if pose is not None]
    visited = [
        _driven(run),
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


def _driven(run: RunData) -> FloatArray:
    """(n, 2) where the robot was; of a recording without a truth where it held itself for localized."""
    path = layers.true_path(run)
    if not np.isfinite(path).all(axis=1).any():
        path = layers.estimated_path(run)[run.trace["localized"] != 0.0]
    return path


def _world_points(run: RunData) -> FloatArray:
    """(n, 2) points that span the world and everything that truly happened in it."""
    world = run.world
    if run.grid is not None:
        # A grid's rim is often unknown for many metres.
        visited = [_driven(run), *(plan.path[:, :2] for plan in run.plans)]
        ends = [robot.start[:2] for robot in world.robots if robot.start is not None]
        return np.concatenate([known_corners(run.grid), *visited, np.array(ends).reshape(-1, 2)])
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
        parts += [_driven(run), *(plan.path[:, :2] for plan in run.plans)]
    return np.concatenate(parts)


def _extent(points: FloatArray, relative: float, least_m: float) -> Limits | None:
    """Return the limits of the finite points with a margin, in parts of their size and at least in metres."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return None
    (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
    margin = max(relative * max(x_max - x_min, y_max - y_min), drawable_m(least_m, points))
    return float(x_min - margin), float(y_min - margin), float(x_max + margin), float(y_max + margin)


def drawable_m(room_m: float, points: FloatArray) -> float:
    """Room around points (n, 2), never so little beside their numbers that axes cannot tell them apart."""
    return max(room_m, _LEAST_MARGIN_M, _FINEST * float(np.abs(points).max()))


def map_axes(limits: Limits) -> tuple[Figure, Axes, float]:
    """Return a figure whose axes have equal scales and fill it, and its points a metre."""
    figure, axes, scale = _axes_beside(limits, _LEFT_PT)
    left_pt = room_at_left_pt(axes)
    return (figure, axes, scale) if left_pt <= _LEFT_PT else _axes_beside(limits, left_pt)


def room_at_left_pt(axes: Axes) -> float:
    """What the axis' label and the numbers beside it take, so that neither is cut off."""
    numbers = axes.yaxis.get_major_formatter().format_ticks(axes.yaxis.get_majorticklocs().tolist())
    return _AXIS_LABEL_PT + TICK_PT * max((sum(map(_width_em, number)) for number in numbers), default=0.0)


def _width_em(character: str) -> float:
    if character in ".,":
        return _NARROW_EM
    return _WIDE_EM if character == "\N{MINUS SIGN}" else _DIGIT_EM


def _axes_beside(limits: Limits, left_pt: float) -> tuple[Figure, Axes, float]:
    x_min, y_min, x_max, y_max = limits
    width = WIDTH_PT - left_pt - _RIGHT_PT
    scale = min(width / (x_max - x_min), _MOST_HEIGHT_PT / (y_max - y_min))
    height = max(scale * (y_max - y_min), _LEAST_HEIGHT_PT)
    # What is too tall or too flat for the page gets room at its sides instead of a distortion.
    x_margin, y_margin = 0.5 * (width / scale - (x_max - x_min)), 0.5 * (height / scale - (y_max - y_min))
    total = height + _TOP_PT + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    axes = figure.add_axes(
        (left_pt / WIDTH_PT, _BOTTOM_PT / total, width / WIDTH_PT, height / total), axes_class=LightAxes
    )
    axes.set_xlim(x_min - x_margin, x_max + x_margin)
    axes.set_ylim(y_min - y_margin, y_max + y_margin)
    axes.set_autoscale_on(False)
    axes.set_xlabel("x [m]", labelpad=2.0)
    axes.set_ylabel("y [m]", labelpad=2.0)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.tick_params(length=0.0)
    return figure, axes, scale
