"""Where who meets others at a passage goes: out of it, and aside of who comes out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.control import eikonal
from pilotage.stack.patrol.roadmap import STEP_M, Roadmap

ASIDE_REACH_M = 6.0
"""Who stands aside goes no farther from the passage's mouth."""
OFF_RATIO, AHEAD_M = 1.8, 3.5
"""Who waits beside a passage stands so many half widths of two off its axis, or so far before it."""
SHORT_M = 0.3
"""Who stands aside may stop so far before the place that it goes to."""
NEARER_M = 0.05
"""Who leaves somebody may come so much nearer: nodes lie beside where it is."""


@dataclass(frozen=True, slots=True, eq=False)
class WayOut:
    """To the end of a passage: time, where that is (2,), and the direction out of it there (2,)."""

    time_s: float
    mouth_xy_m: FloatArray
    outwards: FloatArray


def way_out(
    roadmap: Roadmap,
    x_m: float,
    y_m: float,
    other_xy_m: tuple[float, float],
    keep_m: float,
    pass_m: float,
) -> WayOut | None:
    """The nearest end of the passage that a place is in, not past another; None where there is none.

    Parameters
    ----------
    keep_m
        To keep from the other; as near as it is already is allowed.
    pass_m
        Half the width of what has room for two.
    """
    places = roadmap.nodes_xy_m()
    free = _without(roadmap, np.array(other_xy_m), x_m, y_m, keep_m)
    time = roadmap.field_to(x_m, y_m, np.where(free, roadmap.slowness, np.inf))
    ends = np.where(roadmap.room_m >= pass_m, time, np.inf)
    best = np.unravel_index(int(np.argmin(ends)), ends.shape)
    if not math.isfinite(ends[best]):
        return None
    mouth = places[best]
    x, y = mouth.tolist()
    inwards = eikonal.descent(x, y, roadmap.placed(time))
    return WayOut(float(ends[best]), mouth, -np.array(inwards))


def refuge(
    roadmap: Roadmap,
    x_m: float,
    y_m: float,
    mouth_xy_m: FloatArray,
    outwards: FloatArray,
    bodies_xy_m: FloatArray,
    pass_m: float,
    keep_m: float,
    met_xy_m: FloatArray | None = None,
    coming_xy_m: FloatArray | None = None,
) -> FloatArray | None:
    """(rows, columns) time to the nearest place where nobody stands who is in the way of who comes out.

    It has room for two, lies off the passage's axis and before no other; or else off the paths of those
    who come, be there room for one only; or else as far from the mouth as there is room for two. All
    within ``ASIDE_REACH_M``; None where there is none.

    Parameters
    ----------
    mouth_xy_m, outwards
        (2,) where the passage ends and the direction in which it does.
    bodies_xy_m
        (K, 2) of others, to keep ``keep_m`` from.
    pass_m
        Half the width of what has room for two, and the distance to keep from the axis.
    met_xy_m
        (2,) of who is met: the path leads away from there, be it through a passage; without it through
        none.
    coming_xy_m
        (L, 2) of the paths of those who come out, to keep ``keep_m`` from.
    """
    wide = np.isfinite(roadmap.slowness) & (roadmap.room_m >= pass_m)
    axis = outwards / max(float(np.hypot(*outwards)), 1e-9)
    ground = wide if met_xy_m is None else _without(roadmap, met_xy_m, x_m, y_m, pass_m)
    starts_here = met_xy_m is not None or wide[roadmap.node(x_m, y_m)]
    x, y = (x_m, y_m) if starts_here else (mouth_xy_m + STEP_M * axis).tolist()
    time = roadmap.field_to(x, y, np.where(ground, roadmap.slowness, np.inf))
    # Not close to a wall: there it would take long to come to, and away from.
    fit = wide & np.isfinite(time) & (roadmap.slowness < 1.2 * roadmap.slowness.min())
    rows, columns = np.nonzero(fit)
    places = np.column_stack([columns, rows]) * roadmap.spacing_m + np.array(roadmap.origin_xy_m)
    offset = places - mouth_xy_m
    away = np.hypot(*offset.T)
    free = away <= ASIDE_REACH_M
    for body in bodies_xy_m:
        free &= np.hypot(*(places - body).T) >= keep_m
    off, ahead = np.abs(offset @ np.array([-axis[1], axis[0]])), offset @ axis
    narrow_m = roadmap.spacing_m * scipy.ndimage.distance_transform_edt(wide | ~np.isfinite(roadmap.slowness))
    clear = free & ((off >= OFF_RATIO * pass_m) | (ahead >= AHEAD_M)) & (narrow_m[rows, columns] >= pass_m)
    if clear.any():
        best = int(np.argmin(np.where(clear, time[rows, columns], np.inf)))
        return roadmap.field_to(*places[best].tolist())
    if coming_xy_m is not None and len(coming_xy_m):
        place = _beside(roadmap, x_m, y_m, coming_xy_m, bodies_xy_m, keep_m)
        if place is not None:
            return roadmap.field_to(*place)
    return roadmap.field_to(*places[_farthest(free, away)].tolist()) if free.any() else None


def _beside(
    roadmap: Roadmap, x_m: float, y_m: float, lines_xy_m: FloatArray, bodies_xy_m: FloatArray, keep_m: float
) -> tuple[float, float] | None:
    """The place reached soonest that is off paths (L, 2) and bodies (K, 2), past none of these."""
    nodes, here = roadmap.nodes_xy_m(), np.array([x_m, y_m])
    free, off = np.isfinite(roadmap.slowness), np.ones(roadmap.slowness.shape, dtype=np.bool_)
    for body in bodies_xy_m:
        away_m = np.hypot(*(nodes - body).transpose(2, 0, 1))
        free &= away_m >= min(keep_m, math.dist(body, here))
        off &= away_m >= keep_m
    for place in lines_xy_m:
        off &= np.hypot(*(nodes - place).transpose(2, 0, 1)) >= keep_m + SHORT_M
    off &= np.hypot(*(nodes - here).transpose(2, 0, 1)) <= ASIDE_REACH_M
    time = np.where(free & off, roadmap.field_to(x_m, y_m, np.where(free, roadmap.slowness, np.inf)), np.inf)
    best = np.unravel_index(int(np.argmin(time)), time.shape)
    if not math.isfinite(time[best]):
        return None
    x, y = nodes[best].tolist()
    return x, y


def _without(roadmap: Roadmap, other_xy_m: FloatArray, x_m: float, y_m: float, keep_m: float) -> BoolArray:
    """(rows, columns) where one at a place may go who keeps from another.

    Who is nearer to it already goes away from it: nothing leads on beside who is met.
    """
    nodes, here = roadmap.nodes_xy_m(), np.array([x_m, y_m])
    here_m = math.dist(other_xy_m, here)
    away_m = np.hypot(*(nodes - other_xy_m).transpose(2, 0, 1))
    free: BoolArray = np.isfinite(roadmap.slowness) & (away_m >= min(keep_m, here_m))
    if here_m < keep_m:
        free &= (away_m >= 2.0 * keep_m) | ((nodes - here) @ (other_xy_m - here) <= NEARER_M * here_m)
    return free


def _farthest(free: BoolArray, away_m: FloatArray) -> int:
    return int(np.argmax(np.where(free, away_m, -np.inf)))
