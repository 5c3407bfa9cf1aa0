"""Scans as clouds of points with their lines, in the scanner's frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.scan_lines import rays_of, scan_cloud
from pilotage.logs.laser_log import LaserLog

LEAST_RANGE_M = 0.1


@dataclass(frozen=True, slots=True)
class Clouds:
    """Points of several scans, one after the other: (K, 6) of ``scan_lines`` and (S + 1,) starts."""

    points: FloatArray
    starts: IntArray

    @staticmethod
    def of(clouds: list[FloatArray]) -> Clouds:
        """Put clouds one after the other."""
        return Clouds.filled(clouds, sum(cloud.shape[0] for cloud in clouds))

    @staticmethod
    def filled(clouds: Iterable[FloatArray], most: int) -> Clouds:
        """Put clouds of at most so many points one after the other as they come."""
        points, starts = np.empty((most, 6)), [0]
        for cloud in clouds:
            starts.append(starts[-1] + cloud.shape[0])
            points[starts[-2] : starts[-1]] = cloud
        return Clouds(points[: starts[-1]], np.array(starts, np.int64))

    def and_more(self, other: Clouds) -> Clouds:
        """Return both one after the other."""
        starts = np.concatenate([self.starts, self.starts[-1] + other.starts[1:]])
        return Clouds(np.concatenate([self.points, other.points]), starts)

    def __len__(self) -> int:
        return int(self.starts.shape[0] - 1)

    def __getitem__(self, scan: int) -> FloatArray:
        return self.points[self.starts[scan] : self.starts[scan + 1]]


def cloud_of(log: LaserLog, scan: int, max_range_m: float, spacing: float = 1.0) -> FloatArray:
    """Points (K, 6) of a scan.

    Parameters
    ----------
    spacing
        True angle between beams over the one that the log tells.
    """
    beams = int(log.beams[scan])
    first, step = float(log.first_angle_rad[scan]), float(log.angle_step_rad[scan])
    # The middle stays where it is.
    first += 0.5 * (1.0 - spacing) * step * (beams - 1)
    rays = _rays(first, spacing * step, beams)
    return scan_cloud(log.ranges_m[scan, :beams], rays, step, LEAST_RANGE_M, max_range_m)


@lru_cache(maxsize=4)
def _rays(first_rad: float, step_rad: float, beams: int) -> FloatArray:
    """(B, 2) directions, which are the same for all scans of most recordings."""
    return rays_of(first_rad, step_rad, beams)


def cloud_of_beams(
    ranges_m: FloatArray, angles_rad: FloatArray, step_rad: float, max_range_m: float
) -> FloatArray:
    """Points (K, 6) of ranges (B,), infinite or NaN where nothing was hit, in their directions (B,)."""
    rays = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
    return scan_cloud(ranges_m, rays, step_rad, LEAST_RANGE_M, max_range_m)
