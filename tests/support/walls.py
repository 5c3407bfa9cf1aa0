"""Scans of known walls, for tests of perception and wall matching."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.scans import rays
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.perception.lines import LineExtractionConfig, LineExtractor

LIDAR = LidarConfig()
RANGE_VAR_M2 = LIDAR.range_var_m2


def scan_of(
    world: SegmentMap, pose: Pose2, rng: np.random.Generator | None, lidar: LidarConfig = LIDAR
) -> FloatArray:
    """Ranges seen from ``pose``; without a generator, without noise."""
    first = pose.theta_rad + float(lidar.beam_angles_rad()[0])
    ranges = rays.fan_ranges(
        pose.x_m,
        pose.y_m,
        first,
        lidar.beam_step_rad,
        lidar.beams,
        lidar.max_range_m,
        world.segments_m,
        world.circles_m,
    )
    if rng is None:
        return ranges
    normals = rng.standard_normal(lidar.beams)
    noisy = np.clip(ranges + math.sqrt(lidar.range_var_m2) * normals, 0.0, lidar.max_range_m)
    return np.where(ranges < lidar.max_range_m, noisy, lidar.max_range_m)


def extractor(seed: int = 0, lidar: LidarConfig = LIDAR, **changes: float) -> LineExtractor:
    """A line extractor with its own stream."""
    config = LineExtractionConfig.model_validate(changes)
    return LineExtractor(config, lidar, RANGE_VAR_M2, np.random.default_rng(seed))
