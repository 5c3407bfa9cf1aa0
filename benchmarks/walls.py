"""Lines of one museum scan, extracted and matched to the walls.

    python -m benchmarks.walls

Exit code 0 where the median scan takes at most a millisecond.
"""

from __future__ import annotations

import math
import sys
import time

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.kernels.scans import rays
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.localization.wall_matching import WallMatcher, WallMatchingConfig
from pilotage.stack.perception.lines import LineExtractionConfig, LineExtractor

SCANS = 300
BAR_S = 1e-3
LIDAR = LidarConfig()


def scans() -> list[tuple[Pose2, FloatArray]]:
    """Noisy scans from random places of the museum."""
    world, rng = load_chart("museum").walls, np.random.default_rng(0)
    first, std = float(LIDAR.beam_angles_rad()[0]), math.sqrt(LIDAR.range_var_m2)
    made: list[tuple[Pose2, FloatArray]] = []
    while len(made) < SCANS:
        x, y, theta = (float(value) for value in rng.uniform([0.5, 0.5, -3.1], [39.5, 24.5, 3.1]))
        if world.distance_m(x, y) < 0.45:
            continue
        exact = rays.fan_ranges(
            x,
            y,
            theta + first,
            LIDAR.beam_step_rad,
            LIDAR.beams,
            LIDAR.max_range_m,
            world.segments_m,
            world.circles_m,
        )
        noisy = np.clip(exact + std * rng.standard_normal(LIDAR.beams), 0.0, LIDAR.max_range_m)
        noisy[exact >= LIDAR.max_range_m] = LIDAR.max_range_m
        made.append((Pose2(x, y, theta), noisy))
    return made


def main() -> int:
    """Measure and report."""
    config = LineExtractionConfig()
    extractor = LineExtractor(config, LIDAR, LIDAR.range_var_m2, np.random.default_rng(0))
    matcher = WallMatcher(WallMatchingConfig(), 0.999, load_chart("museum").walls, np.zeros(3))
    cov = np.diag([1e-4, 1e-4, 1e-6])
    data = scans()
    matcher.match(data[0][0].as_array(), cov, extractor.extract(data[0][1]))  # compiles
    whole_s = []
    for pose, ranges in data:
        begin = time.perf_counter()
        lines = extractor.extract(ranges)
        matcher.match(pose.as_array(), cov, lines)
        whole_s.append(time.perf_counter() - begin)
    median_s = float(np.median(whole_s))
    slow_s = float(np.quantile(whole_s, 0.95))
    print(f"extraction and matching: median {median_s * 1e6:.0f} us, 95 % {slow_s * 1e6:.0f} us")
    return 0 if median_s <= BAR_S else 1


if __name__ == "__main__":
    sys.exit(main())
