"""A map made before, as a later recording extends it: keyframes with their scans, and what holds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.marginalization import without
from pilotage.stack.mapping.slam.uncertainty import Edges

CELL_M, RANGE_M = 0.25, 12.0
"""Walls are counted in cells of this side, as far as submaps go."""
SEEN_BY, SEEN_BY_OLD, COVERED = 8, 3, 0.95
"""A keyframe may go where so many others, at least, see this share of its cells: one of the last recording,
and one of those before it."""
GAP_KEYFRAMES = 4
"""So many keyframes left out in a row part a stretch of path in two."""


@dataclass(frozen=True, slots=True)
class KeyframeScans:
    """Scans (K, B) of keyframes as in ``LaserLog``: NaN or infinite where nothing was measured or hit."""

    t_s: FloatArray
    ranges_m: FloatArray
    beams: IntArray
    first_angle_rad: FloatArray
    angle_step_rad: FloatArray

    def chosen(self, which: BoolArray | IntArray) -> KeyframeScans:
        """Return some of them."""
        return KeyframeScans(
            self.t_s[which],
            self.ranges_m[which],
            self.beams[which],
            self.first_angle_rad[which],
            self.angle_step_rad[which],
        )

    def and_more(self, other: KeyframeScans) -> KeyframeScans:
        """Return both one after the other, the shorter rows filled up with NaN."""
        width = max(self.ranges_m.shape[1], other.ranges_m.shape[1])
        rows = [
            np.pad(part.ranges_m, ((0, 0), (0, width - part.ranges_m.shape[1])), constant_values=np.nan)
            for part in (self, other)
        ]
        return KeyframeScans(
            np.concatenate([self.t_s, other.t_s]),
            np.concatenate(rows),
            np.concatenate([self.beams, other.beams]),
            np.concatenate([self.first_angle_rad, other.first_angle_rad]),
            np.concatenate([self.angle_step_rad, other.angle_step_rad]),
        )


def keyframe_scans(log: LaserLog, chosen: IntArray | slice, spacing: float) -> KeyframeScans:
    """Return some scans (K,) of a log, its angles put right by the true spacing over the told one."""
    step, beams = log.angle_step_rad[chosen], log.beams[chosen]
    first = log.first_angle_rad[chosen] + 0.5 * step * (beams - 1) * (1.0 - spacing)
    return KeyframeScans(log.t_s[chosen], log.ranges_m[chosen], beams, first, spacing * step)


@dataclass(frozen=True, slots=True)
class EarlierMap:
    """Keyframes in the order they were taken.

    Attributes
    ----------
    poses
        (K, 3) of the scanner in the map.
    clouds, scans
        Their points, and what they measured.
    edges
        What holds them; how much each counts is in its information.
    breaks
        (B,) keyframes that do not follow the path of the one before.
    last
        First keyframe of the last recording.
    """

    poses: FloatArray
    clouds: Clouds
    scans: KeyframeScans
    edges: Edges
    breaks: IntArray
    last: int = 0

    def __len__(self) -> int:
        return int(self.poses.shape[0])


def needed(poses: FloatArray, clouds: Clouds, last: int = 0) -> BoolArray:
    """(K,) which keyframes, oldest first, show what others do not; ``last`` begins the last recording.

    Every one that stays owns a share of 1 - COVERED of cells that fewer than SEEN_BY others see: their number
    grows with the walls, not with the time spent among them.
    """
    own = []
    for pose, cloud in zip(poses, (clouds[k] for k in range(len(clouds))), strict=True):
        near = cloud[np.hypot(cloud[:, 0], cloud[:, 1]) < RANGE_M, :2]
        cells = np.floor(Pose2.from_array(pose).placed(near) / CELL_M).astype(np.int64)
        own.append(np.unique(cells[:, 0] * 4_000_037 + cells[:, 1]))
    names, which = np.unique(np.concatenate(own), return_inverse=True)
    seen_by = np.bincount(which, minlength=names.size)
    stays = np.ones(len(own), np.bool_)
    ends = np.cumsum([cells.size for cells in own])
    for k, end in enumerate(ends):
        cells = which[end - own[k].size : end]
        enough = SEEN_BY_OLD if k < last else SEEN_BY
        if np.count_nonzero(seen_by[cells] > enough) >= COVERED * cells.size:
            stays[k] = False
            seen_by[cells] -= 1
    stays[-1] = True
    return stays


def pruned(earlier: EarlierMap) -> EarlierMap:
    """Leave out the keyframes that later ones make superfluous; what held the others is kept as a tree."""
    stays = needed(earlier.poses, earlier.clouds, earlier.last)
    kept = np.flatnonzero(stays)
    gaps = np.flatnonzero(np.diff(kept) > GAP_KEYFRAMES) + 1
    after = np.searchsorted(kept, earlier.breaks)
    breaks = np.unique(np.concatenate([gaps, after[(after > 0) & (after < kept.size)]]))
    return EarlierMap(
        earlier.poses[kept],
        Clouds.of([earlier.clouds[int(k)] for k in kept]),
        earlier.scans.chosen(kept),
        without(earlier.edges, earlier.poses, ~stays),
        breaks.astype(np.int64),
        int(np.searchsorted(kept, earlier.last)),
    )
