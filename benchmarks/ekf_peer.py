"""The landmark EKF against filterpy on the same problem: five landmarks in sight at every step.

    python -m benchmarks.ekf_peer [--json]

Both filters predict by the exact arc and take the landmarks one after the other, linearized at the
current estimate, with the same Jacobians; filterpy is given plain numpy functions, as its users write them.
Exit code 0 where the estimates agree to 1e-9 and ours takes at least 100 times its steps a second.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from typing import Any

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.kernels.filters import ekf
from pilotage.kernels.filters.sighting import Known, Seen
from pilotage.kernels.jit import kernel

LANDMARKS = np.array([[8.0, 0.0], [0.0, 9.0], [-7.0, -2.0], [3.0, -8.0], [10.0, 10.0]])
R = np.diag([3.4665e-4, 1.1771e-4])
DENSITIES = np.array([1.286e-4, 0.0, 1.951e-5, 1e-6])
START_COV = np.diag([0.01, 0.01, 0.01])
STEPS = 2000
LONG = 100
BAR = 100.0
AGREE = 1e-9


def problem(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Increments (T, 2), ranges (T, 5), bearings (T, 5) of a robot driving circles, with noise."""
    rng = np.random.default_rng(seed)
    distance, angle = 0.05, 0.02
    truth = np.array([0.5, 0.0, 0.0])
    increments, ranges, bearings = np.empty((STEPS, 2)), np.empty((STEPS, 5)), np.empty((STEPS, 5))
    for t in range(STEPS):
        middle = truth[2] + angle / 2
        truth += [distance * math.cos(middle), distance * math.sin(middle), angle]
        increments[t] = [distance, angle] + rng.normal(size=2) * [2.5e-3, 6e-4]
        away = LANDMARKS - truth[:2]
        ranges[t] = np.hypot(away[:, 0], away[:, 1]) + rng.normal(size=5) * math.sqrt(R[0, 0])
        looks = np.arctan2(away[:, 1], away[:, 0]) - truth[2] + rng.normal(size=5) * math.sqrt(R[1, 1])
        bearings[t] = (looks + math.pi) % (2 * math.pi) - math.pi
    return increments, ranges, bearings


@kernel
def log_filtered(
    increments: FloatArray, ranges: FloatArray, bearings: FloatArray, known: Known, poses: FloatArray
) -> None:
    """The localizer's own kernels over a log; fills ``poses`` (T, 3)."""
    pose, cov, Q, mount = np.array([0.5, 0.0, 0.0]), START_COV.copy(), np.zeros((2, 2)), np.zeros(3)
    for t in range(increments.shape[0]):
        distance, angle = increments[t, 0], increments[t, 1]
        Q[0, 0] = DENSITIES[0] * abs(distance) + DENSITIES[1] * abs(angle)
        Q[1, 1] = DENSITIES[2] * abs(angle) + DENSITIES[3] * abs(distance)
        ekf.predict(pose, cov, distance, angle, Q, True)
        ekf.update_range_bearings(pose, cov, Seen(known.ids, ranges[t], bearings[t]), known, mount, R, np.inf)
        poses[t] = pose


def ours(increments: FloatArray, ranges: FloatArray, bearings: FloatArray) -> FloatArray:
    """Poses (T, 3) by the kernels."""
    poses = np.empty((increments.shape[0], 3))
    log_filtered(increments, ranges, bearings, Known(np.arange(len(LANDMARKS)), LANDMARKS), poses)
    return poses


def filterpys(peer: Any, increments: FloatArray, ranges: FloatArray, bearings: FloatArray) -> FloatArray:
    """Poses (T, 3) by filterpy's ExtendedKalmanFilter."""
    filter_ = peer(dim_x=3, dim_z=2)
    filter_.x, filter_.P, filter_.R = np.array([0.5, 0.0, 0.0]), START_COV.copy(), R.copy()
    poses = np.empty((increments.shape[0], 3))

    def expected(x: FloatArray, mark: FloatArray) -> FloatArray:
        dx, dy = mark - x[:2]
        return np.array([math.hypot(dx, dy), wrap_to_pi(math.atan2(dy, dx) - x[2])])

    def jacobian(x: FloatArray, mark: FloatArray) -> FloatArray:
        dx, dy = mark - x[:2]
        q = dx * dx + dy * dy
        r = math.sqrt(q)
        return np.array([[-dx / r, -dy / r, 0.0], [dy / q, -dx / q, -1.0]])

    def difference(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.array([a[0] - b[0], wrap_to_pi(float(a[1] - b[1]))])

    for t, (d, a) in enumerate(increments):
        half = 0.5 * a
        ratio = math.sin(half) / half
        slope = 0.5 * (half * math.cos(half) - math.sin(half)) / half**2
        middle = filter_.x[2] + half
        c, s = math.cos(middle), math.sin(middle)
        F = np.array([[1.0, 0.0, -d * ratio * s], [0.0, 1.0, d * ratio * c], [0.0, 0.0, 1.0]])
        G = np.array(
            [
                [ratio * c, d * (slope * c - half / a * ratio * s)],
                [ratio * s, d * (slope * s + half / a * ratio * c)],
                [0.0, 1.0],
            ]
        )
        Q = np.diag([DENSITIES[0] * abs(d), DENSITIES[2] * abs(a) + DENSITIES[3] * abs(d)])
        filter_.x = filter_.x + np.array([d * ratio * c, d * ratio * s, a])
        filter_.P = F @ filter_.P @ F.T + G @ Q @ G.T
        for m, mark in enumerate(LANDMARKS):
            z = np.array([ranges[t, m], bearings[t, m]])
            filter_.update(z, jacobian, expected, args=(mark,), hx_args=(mark,), residual=difference)
        poses[t] = filter_.x
    return poses


def main() -> int:
    """Compare and print one line each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--json", action="store_true", help="one JSON object instead of the lines")
    as_json = parser.parse_args().json
    try:
        from filterpy.kalman import ExtendedKalmanFilter
    except ImportError:
        print("filterpy is not installed; 'make bench' installs the peers")
        return 0
    increments, ranges, bearings = problem(0)
    ours(increments[:10], ranges[:10], bearings[:10])  # compiles
    ratios = []
    gap = math.inf
    for _ in range(3):
        begin = time.perf_counter()
        for _ in range(LONG):
            poses = ours(increments, ranges, bearings)
        own = LONG * STEPS / (time.perf_counter() - begin)
        begin = time.perf_counter()
        peers = filterpys(ExtendedKalmanFilter, increments, ranges, bearings)
        other = STEPS / (time.perf_counter() - begin)
        ratios.append(own / other)
        error = poses - peers
        error[:, 2] = (error[:, 2] + math.pi) % (2 * math.pi) - math.pi
        gap = float(np.abs(error).max())
        if not as_json:
            print(
                f"pilotage {own:12,.0f} steps/s   filterpy {other:8,.0f} steps/s   ratio {own / other:8,.0f}"
            )
    ratio = float(np.median(ratios))
    if as_json:
        print(json.dumps({"ratio": ratio, "largest_difference": gap}))
    else:
        print(f"median ratio {ratio:,.0f} (bar {BAR:g}), largest difference {gap:.1e} (bar {AGREE:g})")
    return 0 if ratio >= BAR and gap <= AGREE else 1


if __name__ == "__main__":
    sys.exit(main())
