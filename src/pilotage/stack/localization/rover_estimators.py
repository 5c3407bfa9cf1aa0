"""Estimators of a rover's path from its log: dead reckoning, and a filter on landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import Config
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.filters import rover_filter, rover_odometry
from pilotage.maps.landmarks import Landmarks
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.landmark_log import LandmarkLog
from pilotage.stack.interface import Belief

Order = Literal["first-order", "second-order"]


@dataclass(frozen=True, slots=True)
class LogEstimate:
    """Beliefs after each step of a log.

    Attributes
    ----------
    poses, covs
        (T, 3) and (T, 3, 3).
    nis, outcome
        (S,) squared Mahalanobis distance of each sighting, and whether it was accepted (1), gated (0) or of
        an unknown landmark (-1).
    gate
        The gate as a probability; 1 where nothing is gated.
    """

    poses: FloatArray
    covs: FloatArray
    nis: FloatArray
    outcome: IntArray
    gate: float


class LogEstimator(Protocol):
    """Estimates a path from a log. Built as ``cls(config)``."""

    def estimate(
        self, initial: Belief, log: LandmarkLog, landmarks: Landmarks, sensor: BeaconConfig | None
    ) -> LogEstimate:
        """Run over the whole log; a log fits the robot's plug as the robot does."""
        ...


ESTIMATORS: Registry[LogEstimator] = Registry("estimator", "pilotage.stack.localization")


class DeadReckoningLogConfig(Config):
    """How the covariance grows: linearized (equation 4.5), or by exact moments."""

    covariance: Order = "second-order"


class LandmarkLogFilterConfig(Config):
    """How the prediction is made, and the share of true sightings that the gate lets through."""

    covariance: Order = "second-order"
    gate: float = Field(default=0.9999, gt=0.0, lt=1.0)


@ESTIMATORS.add("dead-reckoning", DeadReckoningLogConfig)
class DeadReckoningLog:
    """Odometry alone (rover report 4.1).

    First order its 95 % ellipse holds the truth in 90 % of the time once the heading is uncertain by some
    degrees; second order in 95 %.
    """

    def __init__(self, config: DeadReckoningLogConfig) -> None:
        self._second = config.covariance == "second-order"

    def estimate(
        self,
        initial: Belief,
        log: LandmarkLog,
        landmarks: Landmarks,  # noqa: ARG002
        sensor: BeaconConfig | None,  # noqa: ARG002
    ) -> LogEstimate:
        """Sum the steps; sightings are not looked at."""
        poses, covs = np.empty((len(log.steps), 3)), np.empty((len(log.steps), 3, 3))
        pose, cov = initial.pose.as_array(), initial.cov.copy()
        rover_odometry.dead_reckon(pose, cov, log.steps, log.variances, self._second, poses, covs)
        unused = np.full(log.ids.shape, np.nan), np.full(log.ids.shape, -1, dtype=np.int64)
        return LogEstimate(poses, covs, *unused, gate=1.0)


@ESTIMATORS.add("ekf-landmarks", LandmarkLogFilterConfig)
class LandmarkLogFilter:
    """Extended Kalman filter on odometer and landmarks (rover report 4.3).

    Updates are iterated and in Joseph form: after a kilometre without landmarks the first bearing is far
    from linear, and equation 4.17 with the covariance before the prediction is a slip that loses symmetry.

    Fails slowly beyond some 2 km without a landmark (heading uncertain by more than 3 degrees): its
    covariance is then too small for a while. Sightings refused one after the other make it less sure, so
    that it comes back.
    """

    def __init__(self, config: LandmarkLogFilterConfig) -> None:
        self._second = config.covariance == "second-order"
        self._gate = config.gate

    def estimate(
        self, initial: Belief, log: LandmarkLog, landmarks: Landmarks, sensor: BeaconConfig | None
    ) -> LogEstimate:
        """Predict and update, step by step."""
        poses, covs = np.empty((len(log.steps), 3)), np.empty((len(log.steps), 3, 3))
        pose, cov = initial.pose.as_array(), initial.cov.copy()
        nis, outcome = np.empty(log.ids.shape), np.empty(log.ids.shape, dtype=np.int64)
        order = np.argsort(landmarks.ids)
        variances = (0.0, 0.0) if sensor is None else (sensor.range_var_m2, sensor.bearing_var_rad2)
        rover_filter.filter_sightings(
            pose,
            cov,
            log.steps,
            log.variances,
            self._second,
            log.first,
            log.ids,
            log.ranges_m,
            log.bearings_rad,
            np.ascontiguousarray(landmarks.ids[order]),
            np.ascontiguousarray(landmarks.points_xy_m[order]),
            np.diag(variances),
            chi_square_quantile(self._gate, 2),
            poses,
            covs,
            nis,
            outcome,
        )
        return LogEstimate(poses, covs, nis, outcome, self._gate)
