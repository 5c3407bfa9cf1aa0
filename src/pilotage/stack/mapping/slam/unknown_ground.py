"""Ground where nothing known is in sight: a scan can fit nowhere there."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, carried

FEW_POINTS = 10
"""A scan of fewer shows nothing that could be found again."""
IN_SIGHT = 40
"""Known points that would be in sight, from which on a scan that fits nowhere speaks against its place."""
SURELY_SEEN = 0.9
"""Walls so much of the farthest hit so far away are seen; those farther may be or not."""


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
