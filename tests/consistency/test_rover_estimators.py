"""Consistency of the rover's estimators on a made-up drive, and filters that are off and must fail.

False-alarm rates: NEES of 60 runs at a few steps is chi-square with 180 degrees of freedom over 60; a band of
99.99 % at each of four steps alarms falsely in fewer than 1 of 2000 draws of the seeds. Ellipses: 400 runs of
dead reckoning hold the truth in 95 % +- 1.1 % at a step; bounds at 4 standard errors.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.rover_metrics import in_ellipse
from pilotage.maps.landmarks import Landmarks
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.rover_sensing import landmark_log
from pilotage.stack.interface import Belief
from pilotage.stack.localization.rover_estimators import (
    DeadReckoningLog,
    DeadReckoningLogConfig,
    LandmarkLogFilter,
    LandmarkLogFilterConfig,
    LogEstimate,
)

# Steps of 4 m: the noise of ten of the report's steps in one, so that few steps make a long way.
ODOMETER = WheelOdometryConfig(
    distance_var_m2_per_m=4e-5, angle_var_rad2_per_rad=0.0, angle_var_rad2_per_m=1.9038589e-6
)
SEER = BeaconConfig(
    field_of_view_rad=2.0 * math.pi, max_range_m=500.0, range_var_m2=0.01, bearing_var_rad2=1.9038589e-5
)
INITIAL = np.array([36.0, 36.0, math.radians(1.0) ** 2])
STEPS = 2000


def way() -> FloatArray:
    """(N, 3) 8 km in a wide bend."""
    theta = 0.9 * np.linspace(0.0, 1.0, STEPS + 1) ** 2
    x = np.concatenate([[0.0], np.cumsum(4.0 * np.cos(theta[:-1]))])
    y = np.concatenate([[0.0], np.cumsum(4.0 * np.sin(theta[:-1]))])
    return np.column_stack([x, y, theta])


TRUTH = way()
# One landmark at a time, and more than a kilometre without any: the hard case for a filter.
LANDMARKS = Landmarks(np.arange(4), TRUTH[[250, 750, 1250, 1750], :2] + np.array([120.0, -210.0]))


def estimate(seed: int, estimator: Any, odometer: WheelOdometryConfig = ODOMETER) -> LogEstimate:
    streams = RandomStreams(seed)
    log = landmark_log(TRUTH, ("odometer", ODOMETER), ("lidar", SEER), LANDMARKS, streams)
    if odometer is not ODOMETER:
        claimed = landmark_log(TRUTH, ("odometer", odometer), None, LANDMARKS, streams).variances
        log = type(log)(log.steps, claimed, log.first, log.ids, log.ranges_m, log.bearings_rad)
    x, y, theta = (TRUTH[0] + np.sqrt(INITIAL) * streams.stream("initial").standard_normal(3)).tolist()
    found = estimator.estimate(Belief(Pose2(x, y, theta), np.diag(INITIAL)), log, LANDMARKS, SEER)
    assert isinstance(found, LogEstimate)
    return found


def mean_nees(estimator: Any, odometer: WheelOdometryConfig = ODOMETER, runs: int = 60) -> FloatArray:
    truth = np.column_stack([TRUTH[1:, :2], wrap_array_to_pi(TRUTH[1:, 2])])
    found = [estimate(seed, estimator, odometer) for seed in range(runs)]
    return np.asarray(np.mean([nees(truth.copy(), run.poses, run.covs) for run in found], axis=0))


AT = [300, 600, 800, 1980]
"""In sight of the first landmark, on the way to the second, past it, and after the last."""


def inside(values: FloatArray, runs: int = 60) -> list[bool]:
    low, high = (float(chi2.ppf(share, 3 * runs)) / runs for share in (5e-5, 1.0 - 5e-5))
    return [bool(low < float(values[k]) < high) for k in AT]


def test_the_filter_on_landmarks_is_consistent() -> None:
    values = mean_nees(LandmarkLogFilter(LandmarkLogFilterConfig()))
    assert all(inside(values)), values[AT]


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_filter_with_wrong_odometry_variances_is_found_out(factor: float) -> None:
    off = ODOMETER.model_copy(
        update={
            name: factor * getattr(ODOMETER, name)
            for name in ("distance_var_m2_per_m", "angle_var_rad2_per_m")
        }
    )
    assert not all(inside(mean_nees(LandmarkLogFilter(LandmarkLogFilterConfig()), off)))


def test_the_first_order_filter_is_too_sure() -> None:
    values = mean_nees(LandmarkLogFilter(LandmarkLogFilterConfig(covariance="first-order")))
    assert not all(inside(values))


@pytest.mark.parametrize(
    ("order", "low", "high"), [("second-order", 0.93, 0.97), ("first-order", 0.80, 0.925)]
)
def test_the_ellipses_of_dead_reckoning_hold_the_truth_as_often_as_said(
    order: Any, low: float, high: float
) -> None:
    """Averaged over the second half of the way, where the heading is uncertain by some degrees."""
    # Twice the turn noise, for a heading as uncertain as at the end of the report's 13 km.
    noisy = ODOMETER.model_copy(update={"angle_var_rad2_per_m": 2.0 * ODOMETER.angle_var_rad2_per_m})
    estimator = DeadReckoningLog(DeadReckoningLogConfig(covariance=order))
    held = []
    for seed in range(400):
        streams = RandomStreams(seed)
        log = landmark_log(TRUTH, ("odometer", noisy), None, LANDMARKS, streams)
        x, y, theta = (TRUTH[0] + np.sqrt(INITIAL) * streams.stream("initial").standard_normal(3)).tolist()
        run = estimator.estimate(Belief(Pose2(x, y, theta), np.diag(INITIAL)), log, LANDMARKS, None)
        held.append(in_ellipse(TRUTH[1:], run.poses, run.covs, 0.95)[STEPS // 2 :].mean())
    assert low < float(np.mean(held)) < high
