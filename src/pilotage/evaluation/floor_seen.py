"""How much of the floor robots have seen lately, and how few who stand still would see it all."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol.cover import greedy_cover
from pilotage.kernels.patrol.visibility import last_seen
from pilotage.maps.segment_map import SegmentMap

BEAMS = 720
"""Of the fan that says what is in view: a point counts where both beams beside it reach as far."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorSeen:
    """Ages of the floor's points: time since each was last in view of any robot's laser.

    Attributes
    ----------
    age_mean_s, age_worst_s
        Over points and the time looked at.
    point_mean_s, point_worst_s, point_last_s
        (M,) of each point; the last is the time when it was seen last.
    share
        (T, W) share of the points that were in view within the last window, at each step.
    """

    age_mean_s: float
    age_worst_s: float
    point_mean_s: FloatArray
    point_worst_s: FloatArray
    point_last_s: FloatArray
    share: FloatArray


def floor_seen(
    times_s: FloatArray,
    poses: FloatArray,
    points_xy_m: FloatArray,
    walls: SegmentMap,
    reach_m: float,
    field_of_view_rad: float = 2.0 * math.pi,
    windows_s: tuple[float, ...] = (),
    warm_s: float = 0.0,
) -> FloorSeen:
    """Follow what robots saw over a run; people and other robots hide nothing.

    Parameters
    ----------
    times_s
        (T,) ascending; all points count as seen at the first.
    poses
        (T, N, 3) of the lasers in the map; nan while a robot sees nothing. Between steps nothing is seen, so
        they should be as near as the robots' speed over the points' spacing asks for.
    points_xy_m
        (M, 2) the floor, say ``floor.middles(floor.swept)``.
    warm_s
        Means and worst ages leave out what came before; ages themselves go on from there.
    """
    begin = int(np.searchsorted(times_s, times_s[0] + warm_s)) if warm_s > 0.0 else 0
    last, mean, worst, share = last_seen(
        np.ascontiguousarray(times_s, dtype=np.float64),
        np.ascontiguousarray(poses, dtype=np.float64),
        0.5 * field_of_view_rad,
        reach_m,
        np.ascontiguousarray(points_xy_m, dtype=np.float64),
        BEAMS,
        walls.segments_m,
        walls.circles_m,
        np.array(windows_s, dtype=np.float64),
        begin,
    )
    return FloorSeen(float(mean.mean()), float(worst.max()), mean, worst, last, share)


def guard_bound(sees: BoolArray, seconds: float = 20.0) -> tuple[int, int]:
    """How few of the places see every point that any of them sees: a lower bound, and a number that suffices.

    They are the same where the integer program comes to its end in time (HiGHS).

    Parameters
    ----------
    sees
        (P, M) as from ``stack.patrol.derive.views``; the answer is for these places and points, not for the
        plane.
    """
    some = sees[:, sees.any(axis=0)]
    if some.shape[1] == 0:
        return 0, 0
    greedy = len(greedy_cover(some, np.zeros(len(some)), np.zeros(some.shape[1], np.bool_)))
    # Points seen from the same places are one.
    kept = some[:, np.unique(np.packbits(some, axis=0), axis=1, return_index=True)[1]]
    found = milp(
        np.ones(len(kept)),
        constraints=LinearConstraint(csr_array(kept.T.astype(np.float64)), lb=1.0),
        integrality=np.ones(len(kept), dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        options={"time_limit": seconds},
    )
    fewest = greedy if found.x is None else min(greedy, round(float(np.sum(found.x))))
    bound = found.mip_dual_bound
    least = 1 if bound is None else max(1, math.ceil(float(bound) - 1e-6))
    return min(fewest, least), fewest
