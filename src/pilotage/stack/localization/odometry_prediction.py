"""The prediction that every localizer shares: odometry increments and their covariance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.filters import ekf
from pilotage.models.odometry import OdometryModel, increment_variances
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig


class OdometryNoise(Config):
    """Noise that the filter believes in; a field left out is taken from the sensor's data sheet."""

    distance_var_m2_per_m: NonNegative | None = None
    distance_var_m2_per_rad: NonNegative | None = None
    angle_var_rad2_per_rad: NonNegative | None = None
    angle_var_rad2_per_m: NonNegative | None = None


class OdometryBelief(OdometryNoise):
    """Of a filter that takes turns from wheels and gyroscope together, where the robot carries one."""

    gyroscope: bool = True
    """Whether it does (``gyro_odometry``)."""


Predict = Callable[[FloatArray, FloatArray, float, float, FloatArray, bool], None]
"""A kernel that moves pose (3,) and covariance (3, 3) in place by distance, angle and their Q."""


class OdometryPrediction:
    """Moves pose and covariance by odometry increments.

    Parameters
    ----------
    var_scale
        Factor on all variances, for experiments with a filter that is wrong about its noise.
    predict
        The arithmetic: linearized (EKF, if None) or by points (UKF).
    """

    def __init__(
        self,
        sensor: WheelOdometryConfig,
        believed: OdometryNoise,
        var_scale: Positive,
        model: OdometryModel,
        predict: Predict | None = None,
    ) -> None:
        told = believed.model_dump(include=set(OdometryNoise.model_fields), exclude_none=True)
        densities = sensor.model_copy(update=told).densities
        self._densities = tuple(var_scale * density for density in densities)
        self._predict = ekf.predict if predict is None else predict
        self.with_gyroscope = isinstance(believed, OdometryBelief) and believed.gyroscope
        self.exact = model is OdometryModel.EXACT_ARC
        self._Q = np.zeros((2, 2))

    def variances(self, odometry: OdometryIncrement) -> tuple[float, float]:
        """Variances of an increment's distance and angle."""
        distance, angle = self.variances_of(odometry.distance_m, odometry.angle_rad)
        if odometry.lateral_m != 0.0:
            angle += increment_variances(odometry.lateral_m, 0.0, *self._densities)[1]
        own, part = odometry.angle_var_rad2, odometry.part_var
        return distance + part[0], (angle if own is None else own) + part[2]

    def variances_of(self, distance_m: float, angle_rad: float) -> tuple[float, float]:
        """The same of a distance and an angle that say nothing else."""
        return increment_variances(distance_m, angle_rad, *self._densities)

    def lateral_variance(self, odometry: OdometryIncrement) -> float:
        """Variance of what an increment tells of driving to the left, which errs as driving forwards does."""
        return increment_variances(odometry.lateral_m, 0.0, *self._densities)[0] + odometry.part_var[1]

    def move(self, pose: FloatArray, cov: FloatArray, odometry: OdometryIncrement) -> None:
        """Move ``pose`` (3,) and ``cov`` (3, 3) in place."""
        self._Q[0, 0], self._Q[1, 1] = self.variances(odometry)
        self._predict(pose, cov, odometry.distance_m, odometry.angle_rad, self._Q, self.exact)
        if odometry.lateral_m != 0.0:
            variance = self.lateral_variance(odometry)
            ekf.predict_sideways(pose, cov, odometry.lateral_m, odometry.angle_rad, variance, self.exact)
