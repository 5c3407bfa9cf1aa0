"""Where one submap lies on another: search, alignment, and what speaks for and against it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.branch_bound import search_window
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between
from pilotage.stack.mapping.slam.local_matching import BUCKET_M
from pilotage.stack.mapping.slam.submaps import Submap, Submaps

STEP_RAD = 0.02
BUDGET = 400_000
HIT_SCORE = 0.3
LEAST_MEAN = 0.25
SAME_PLACE_M, SAME_HEADING_RAD = 0.8, 0.35
"""A second answer nearer than this is the first one."""
ALIGN_REACH_M, ALIGN_LAST_REACH_M, ALIGN_SCALE_M = 0.4, 0.15, 0.05


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
        Whether the continuous alignment went through.
    """

    relative: FloatArray
    hessian: FloatArray
    score: float
    second: float
    agreement: float
    overlap: float
    aligned: bool


def match(
    submaps: Submaps, earlier: int, later: int, predicted: FloatArray, half_m: float, half_rad: float
) -> Match:
    """Search a submap in the window around where the graph has it on an earlier one."""
    map_, moving = submaps[earlier], submaps[later]
    pyramid, margin = submaps.pyramid(earlier)
    turns = int(np.ceil(half_rad / STEP_RAD))
    points = np.ascontiguousarray(moving.coarse[:, :2])
    angles: FloatArray = STEP_RAD * np.arange(-turns, turns + 1, dtype=np.float64)
    corner = map_.corner_xy_m

    def search(least: float, away: FloatArray) -> FloatArray:
        best, _ = search_window(
            pyramid,
            margin,
            corner[0],
            corner[1],
            submaps.cell_m,
            points,
            predicted,
            half_m,
            angles,
            least,
            away,
            BUDGET,
        )
        return np.asarray(best)

    best = search(LEAST_MEAN, np.array([0.0, 0.0, 0.0, -1.0, 0.0]))
    if not np.isfinite(best[3]):
        return Match(predicted, np.zeros((3, 3)), 0.0, 0.0, 0.0, 0.0, False)
    other = search(
        max(LEAST_MEAN, 0.6 * float(best[3])),
        np.concatenate([best[:3], [SAME_PLACE_M, SAME_HEADING_RAD]]),
    )
    box, starts, _, reference = sort_into_buckets(map_.fine, BUCKET_M)
    pose, hessian, _, status = align(
        moving.fine,
        best[:3].copy(),
        1e-3 * np.eye(3),
        ALIGN_REACH_M,
        ALIGN_LAST_REACH_M,
        ALIGN_SCALE_M,
        40,
        box,
        starts,
        reference,
    )
    pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
    forth = _lying(map_, submaps.cell_m, moving.fine, pose)
    back = _lying(moving, submaps.cell_m, map_.fine, between(pose, np.zeros(3)))
    return Match(
        pose,
        hessian,
        float(best[3]),
        float(other[3]) if np.isfinite(other[3]) else 0.0,
        min(forth[0], back[0]),
        min(forth[1], back[1]),
        status != TOO_FEW,
    )


def _lying(map_: Submap, cell_m: float, points: FloatArray, pose: FloatArray) -> tuple[float, float]:
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
