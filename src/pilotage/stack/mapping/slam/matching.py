"""Where one submap lies on another: search, alignment, and what speaks for and against it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.branch_bound import NO_SEED, PASS_OVER_NONE, search_window
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.match_grid import Scores
from pilotage.kernels.slam.slips import CHANCE
from pilotage.stack.mapping.slam.local_matching import BUCKET_M
from pilotage.stack.mapping.slam.submaps import Submap, Submaps

STEP_RAD = 0.02
BUDGET = 400_000
HIT_SCORE = 0.3
LEAST_MEAN, RIVAL_SHARE = 0.25, 0.6
SAME_PLACE_M, SAME_HEADING_RAD = 0.8, 0.35
"""A second answer nearer than this is the first one."""
PRIOR = read_only(1e-3 * np.eye(3))
ALIGN_REACH_M, ALIGN_LAST_REACH_M, ALIGN_SCALE_M = 0.4, 0.15, 0.05
MOST_ALIGNED_M, MOST_ALIGNED_RAD = 0.25, 0.1
"""An alignment that ends farther from the place that was searched has slid along a corridor."""
HARDLY_HELD, BESIDE_M, BESIDE_RAD = 0.15, 0.3, 0.1
"""Share of the points' weights that holds a match along a course on which another place lies all the same,
and how far from the course that place may be."""


@dataclass(frozen=True, slots=True)
class Match:
    """How a submap lies on another, or where nothing was found a score alone.

    Attributes
    ----------
    relative
        (3,) the later submap's reference keyframe seen from the earlier one's.
    hessian
        (3, 3) of the alignment.
    score, second
        Mean score a point of the best place, and of the best other one in the window (0: none worth naming).
    agreement
        The smaller share, of both ways round, of points on walls among those where the other one saw.
    overlap
        The smaller share of points where the other one saw.
    aligned
        Whether the continuous alignment went through, and ended where the search had it.
    course
        (2,) unit vector in the earlier one's frame along which the walls leave the place open, as a corridor
        does; zero: there is none. Along it ``relative`` is what was predicted, the hessian tells nothing, and
        ``second`` is the best place beside it.
    """

    relative: FloatArray
    hessian: FloatArray
    score: float
    second: float
    agreement: float
    overlap: float
    aligned: bool
    course: FloatArray = field(default_factory=lambda: np.zeros(2))


def match(
    submaps: Submaps, earlier: int, later: int, predicted: FloatArray, half_m: float, half_rad: float
) -> Match:
    """Search a submap in the window around where the graph has it on an earlier one."""
    scores = submaps.scores(earlier)
    map_, moving, cell_m = submaps[earlier], submaps[later], submaps.cell_m
    found, _ = laid(map_, scores, moving, predicted, half_m, half_rad)
    if found.score <= 0.0:
        return found
    agreement, overlap = lying(moving, cell_m, map_.fine, between(found.relative, np.zeros(3)))
    relative = found.relative.copy()
    relative[:2] += found.course * (found.course @ (predicted - relative)[:2])
    agreement, overlap = min(found.agreement, agreement), min(found.overlap, overlap)
    return replace(found, relative=relative, agreement=agreement, overlap=overlap)


def laid(
    map_: Submap,
    scores: Scores,
    moving: Submap,
    predicted: FloatArray,
    half_m: float,
    half_rad: float,
    least_score: float = LEAST_MEAN,
    rival_share: float = RIVAL_SHARE,
    budget: int = BUDGET,
    worth_rivals: Callable[[Match], bool] | None = None,
) -> tuple[Match, bool]:
    """Search a submap in a window of a map.

    Parameters
    ----------
    least_score, rival_share
        Mean score a point from which a place is one, and share of the best one's from which another is told.
    worth_rivals
        Whether other places are looked for, by the match alone. Where this is given none are looked for
        either if the budget did not suffice for the best, and any other place will do for ``second``.

    Returns
    -------
    The match, whose agreement and overlap are those of the submap's points on the map, and whether the budget
    of nodes sufficed to look everywhere.
    """
    turns = int(np.ceil(half_rad / STEP_RAD))
    points = np.ascontiguousarray(moving.coarse[:, :2])
    angles: FloatArray = STEP_RAD * np.arange(-turns, turns + 1, dtype=np.float64)

    def search(least: float, away: FloatArray, any_will_do: bool = False) -> tuple[FloatArray, bool]:
        best, nodes = search_window(
            scores, points, predicted, half_m, angles, least, away, budget, NO_SEED, any_will_do
        )
        return np.asarray(best), nodes > budget

    best, cut_short = search(least_score, PASS_OVER_NONE)
    if not np.isfinite(best[3]):
        return Match(predicted, np.zeros((3, 3)), 0.0, 0.0, 0.0, 0.0, False), not cut_short
    box, starts, _, reference = sort_into_buckets(map_.fine, BUCKET_M)
    pose, hessian, fit, status = align(
        moving.fine,
        best[:3].copy(),
        PRIOR,
        ALIGN_REACH_M,
        ALIGN_LAST_REACH_M,
        ALIGN_SCALE_M,
        40,
        box,
        starts,
        reference,
    )
    pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
    agreement, overlap = lying(map_, scores.cell_m, moving.fine, pose)
    slid = between(best[:3], pose)
    held = float(np.hypot(slid[0], slid[1])) < MOST_ALIGNED_M and abs(float(slid[2])) < MOST_ALIGNED_RAD
    aligned = status != TOO_FEW and held
    found = Match(pose, hessian, float(best[3]), 0.0, agreement, overlap, aligned)
    if worth_rivals is not None and (cut_short or not worth_rivals(found)):
        return found, not cut_short
    any_rival = worth_rivals is not None
    rival = max(LEAST_MEAN, rival_share * float(best[3]))
    other, again = search(rival, np.array([*best[:3], SAME_PLACE_M, SAME_HEADING_RAD, 0.0, 0.0]), any_rival)
    course = open_course(hessian, float(fit[1]), other[:3] - best[:3] if np.isfinite(other[3]) else None)
    if course.any():
        other, again = search(
            rival, np.array([*best[:3], SAME_PLACE_M, SAME_HEADING_RAD, *course]), any_rival
        )
        free = np.append(course, 0.0)
        pull = hessian @ free
        hessian = hessian - np.outer(pull, pull) / max(free @ pull, 1e-9)
    second = float(other[3]) if np.isfinite(other[3]) else 0.0
    found = replace(found, hessian=hessian, second=second, course=course)
    return found, not (cut_short or again)


def open_course(hessian: FloatArray, weight: float, other: FloatArray | None) -> FloatArray:
    """Return the course (2,) along which an alignment leaves the place open; zero where the walls hold it.

    Parameters
    ----------
    hessian, weight
        (3, 3) of the alignment, and the sum of its points' weights.
    other
        (3,) how far away the best other place in the window is, if there is any.
    """
    if weight <= 0.0 or hessian[2, 2] <= 0.0:
        return np.zeros(2)
    held = hessian[:2, :2] - np.outer(hessian[:2, 2], hessian[:2, 2]) / hessian[2, 2]
    told, axes = np.linalg.eigh(held)
    course = np.asarray(axes[:, 0], np.float64)
    if told[0] < CHANCE * weight:
        return course
    if other is None or told[0] > HARDLY_HELD * weight:
        return np.zeros(2)
    turn = abs((other[2] + np.pi) % (2.0 * np.pi) - np.pi)
    beside = abs(course[0] * other[1] - course[1] * other[0]) < BESIDE_M and turn < BESIDE_RAD
    return course if beside else np.zeros(2)


def lying(map_: Submap, cell_m: float, points: FloatArray, pose: FloatArray) -> tuple[float, float]:
    """Share of points on walls among those where the map saw, and the share of the latter of all."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x = pose[0] + c * points[:, 0] - s * points[:, 1]
    y = pose[1] + s * points[:, 0] + c * points[:, 1]
    column = np.floor((x - map_.corner_xy_m[0]) / cell_m).astype(np.int64)
    row = np.floor((y - map_.corner_xy_m[1]) / cell_m).astype(np.int64)
    rows, columns = map_.grid.shape
    inside = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
    values = map_.grid[row[inside], column[inside]]
    walls, open_ = int(np.count_nonzero(values > HIT_SCORE)), int(np.count_nonzero(values < 0.0))
    seen = walls + open_
    return walls / max(1, seen), seen / max(1, points.shape[0])
