"""Scans of ground where nothing known is in sight: they can fit nowhere, and hang by the odometry."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.frames import between, carried, composed
from pilotage.kernels.slam.placing import distance
from pilotage.kernels.slam.wheels import Wheels, righted
from pilotage.stack.mapping.slam.uncertainty import TRACK_STD_M, relative_poses

FEW_POINTS = 10
"""A scan of fewer shows nothing that could be found again."""
IN_SIGHT = 40
"""Known points that would be in sight, from which on a scan that fits nowhere speaks against its place."""
SURELY_SEEN = 0.9
"""Walls so much of the farthest hit so far away are seen; those farther may be or not."""
STRETCH_M, STRETCHES = 1.0, 60
"""An odometry is judged by the last so many stretches of so much path, a radian counting as half a metre:
over them errors of the alignments, which do not add up, are small."""
JUDGED_ANEW = 100
"""After so many scans it is judged anew."""
OPEN_M = 0.1
"""An alignment leaves a direction open along which it tells a place to no better than this."""
STANDING_VAR = np.array([0.002, 0.002, 0.001]) ** 2
EXPECTED_STD, EXPECTED = 0.05, 2.0
"""What it may be expected to be off by, a metre or half a radian, and how many stretches that counts as."""


class View:
    """How far, and between which bearings, the scanner has seen anything so far."""

    def __init__(self) -> None:
        self._reach_m, self._first_rad, self._last_rad = 0.0, np.inf, -np.inf

    def grow(self, cloud: FloatArray) -> None:
        """Take note of a scan's points (K, 2 or more) in its frame."""
        if len(cloud):
            bearings = np.arctan2(cloud[:, 1], cloud[:, 0])
            self._reach_m = max(self._reach_m, float(np.hypot(cloud[:, 0], cloud[:, 1]).max()))
            self._first_rad = min(self._first_rad, float(bearings.min()))
            self._last_rad = max(self._last_rad, float(bearings.max()))

    def shows_any(self, known: list[tuple[FloatArray, FloatArray]], pose: FloatArray) -> bool:
        """Whether enough points of scans (K, 6), each with its pose (3,), would be in sight from another."""
        count = 0
        for cloud, at in known:
            points = carried(cloud, between(pose, at))
            near = np.hypot(points[:, 0], points[:, 1]) < SURELY_SEEN * self._reach_m
            bearings = np.arctan2(points[near, 1], points[near, 0])
            count += int(((bearings >= self._first_rad) & (bearings <= self._last_rad)).sum())
        return count >= IN_SIGHT


class OdometryRecord:
    """What the odometry told beside where scans were found to lie: how unsure motions are by it alone.

    Attributes
    ----------
    poses
        (3,) each, of the scanner at each scan by the odometry, in any frame.
    """

    def __init__(self) -> None:
        self.poses: list[FloatArray] = [np.zeros(3)]
        self._alone: set[int] = set()
        self._rates: tuple[int, FloatArray] | None = None

    def add(self, step: FloatArray | None) -> None:
        """Take note of the motion (3,) to the next scan, if there is any."""
        here = self.poses[-1]
        self.poses.append(here if step is None else np.asarray(composed(here, step)))

    def slip(self, scan: int, step: FloatArray, track: list[FloatArray], wheels: Wheels) -> FloatArray:
        """Covariance (3, 3), in the scanner's frame, of the motion (3,) to a scan that hangs by it.

        ``track``: (3,) each, poses of all scans before it.
        """
        self._alone.add(scan)
        return np.diag(self._judged(track, wheels) * distance(step, np.zeros(3)))

    def told(self, scans: IntArray, track: list[FloatArray], wheels: Wheels) -> FloatArray:
        """Information (K - 1, 3, 3) of the motions between scans (K,) of a track."""
        poses = np.array([self.poses[k] for k in scans])
        moved = relative_poses(poses[:-1], poses[1:])
        path_m = np.hypot(moved[:, 0], moved[:, 1]) + 0.5 * np.abs(moved[:, 2])
        variances = self._judged(track, wheels) * path_m[:, None] + STANDING_VAR
        return np.asarray(np.eye(3) / variances[:, None])

    def _judged(self, track: list[FloatArray], wheels: Wheels) -> FloatArray:
        """Variances (3,) a metre of path, judged anew now and then."""
        if self._rates is None or len(track) - self._rates[0] >= JUDGED_ANEW:
            self._rates = len(track), self._rates_of(track, wheels)
        return self._rates[1]

    def _rates_of(self, track: list[FloatArray], wheels: Wheels) -> FloatArray:
        """Variances (3,) a metre, from stretches that lead to scans which were found."""
        told, found = np.array(self.poses[: len(track)]), np.array(track)
        turns = np.abs(wrap_array_to_pi(np.diff(told[:, 2])))
        path_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(told[:, :2], axis=0).T) + 0.5 * turns))
        count = min(int(path_m[-1] / STRETCH_M), STRETCHES)
        cuts = np.searchsorted(path_m, path_m[-1] - STRETCH_M * np.arange(count, -1.0, -1.0))
        sums, number = EXPECTED * np.array([1.0, 1.0, 4.0]) * EXPECTED_STD**2, EXPECTED
        for a, b in pairwise(np.minimum(cuts, len(track) - 1).tolist()):
            if self._alone.isdisjoint(range(a, b + 1)) and path_m[b] > path_m[a]:
                off = between(righted(wheels, between(told[a], told[b])), between(found[a], found[b]))
                sums, number = sums + off**2 / (path_m[b] - path_m[a]), number + 1.0
        sums[:2] = sums[:2].mean()
        return np.asarray(sums / number)


def with_odometry(hessians: FloatArray, told: FloatArray) -> FloatArray:
    """Hessians (K, 3, 3) of alignments with what the odometry tells (K, 3, 3) where they leave a place open.

    A bare wall holds a robot across it alone. For recordings that is all one can say, as stamps lie; on a
    robot odometry and scans belong together.
    """
    weakest = np.linalg.eigvalsh(hessians[:, :2, :2])[:, 0] / TRACK_STD_M**2
    return np.where((weakest < OPEN_M**-2)[:, None, None], hessians + TRACK_STD_M**2 * told, hessians)
