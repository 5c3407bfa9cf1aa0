"""The EKF on beacons that learns, as it goes, what its sensors are systematically wrong by."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray
from pilotage.kernels.filters import augmented
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig, Update
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_prediction import Predict

NAME = "ekf-augmented"
ERRORS = {"distance_scale": "1", "angle_scale": "1", "angle_bias_rad_s": "rad/s", "bearing_offset_rad": "rad"}
ERROR_COLUMNS = {column: unit for name, unit in ERRORS.items() for column in (name, f"{name}_std")}
"""Of the trace: each error as believed, and its standard deviation."""


class SystematicErrors(Config):
    """What is believed of the errors at the start: values, variances, and how fast these grow.

    A variance of 0 (with no walk) holds an error at its value.
    """

    distance_scale: float = Field(default=1.0, gt=0.5, lt=2.0)
    """Claimed over true distance."""
    angle_scale: float = Field(default=1.0, gt=0.5, lt=2.0)
    """Claimed over true turn."""
    angle_bias_rad_s: float = 0.0
    """Turn that is claimed at rest: a gyroscope's bias."""
    bearing_offset_rad: float = 0.0
    """By how much bearings read too large."""
    distance_scale_var: NonNegative = 4.0e-4
    angle_scale_var: NonNegative = 4.0e-4
    angle_bias_var_rad2_s2: NonNegative = 1.0e-6
    bearing_offset_var_rad2: NonNegative = 4.0e-4
    distance_scale_walk_var_per_s: NonNegative = 0.0
    angle_scale_walk_var_per_s: NonNegative = 0.0
    angle_bias_walk_var_rad2_s3: NonNegative = 0.0
    bearing_offset_walk_var_rad2_per_s: NonNegative = 0.0


class EkfAugmentedConfig(LandmarkFilterConfig):
    """The landmark filter's parameters, and what is believed of the systematic errors."""

    systematic: SystematicErrors = SystematicErrors()


@LOCALIZERS.add(NAME, EkfAugmentedConfig)
class EkfAugmentedLocalizer(LandmarkFilter):
    """Extended Kalman filter that estimates odometry scales, angle bias and bearing offset with the pose.

    State augmentation (Bar-Shalom et al. 2001, sect. 11.9; Martinelli et al. 2007 for odometry). A plain
    filter takes a scale error for noise that it does not have and becomes overconfident; here it is
    estimated, and its uncertainty counts.

    Fails to tell apart what the drive does not: without turns no angle scale, driving at one turn rate
    only, angle scale and bias are one. The covariance says so.
    """

    NAME = NAME

    def __init__(
        self,
        config: EkfAugmentedConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        super().__init__(config, robot, chart, initial, journal)
        believed = config.systematic
        self._walk = np.array(
            [
                believed.distance_scale_walk_var_per_s,
                believed.angle_scale_walk_var_per_s,
                believed.angle_bias_walk_var_rad2_s3,
                believed.bearing_offset_walk_var_rad2_per_s,
            ]
        )
        errors = [
            believed.distance_scale,
            believed.angle_scale,
            believed.angle_bias_rad_s,
            believed.bearing_offset_rad,
        ]
        self._pose = np.concatenate([self._pose, errors])
        cov = np.diag(
            [
                *(0.0, 0.0, 0.0),
                believed.distance_scale_var,
                believed.angle_scale_var,
                believed.angle_bias_var_rad2_s2,
                believed.bearing_offset_var_rad2,
            ]
        )
        cov[: augmented.POSE, : augmented.POSE] = self._cov
        self._cov = cov
        _, odometry = robot.one_sensor(WheelOdometryConfig, NAME)
        self._period_s = 1.0 / odometry.rate_hz
        self._odometry_s: float | None = None
        self._since_s = self._period_s
        self._errors = journal.channel(ERROR_COLUMNS)

    def _kernels(self) -> tuple[Predict, Update]:
        return self._predict, augmented.update_range_bearings

    def step(self, readings: Readings) -> Belief:
        """Predict by the odometry reading less its errors, then update by every beacon seen."""
        if self._odometry in readings.by_sensor:
            last = readings.t_s - self._period_s if self._odometry_s is None else self._odometry_s
            self._since_s, self._odometry_s = readings.t_s - last, readings.t_s
        belief = super().step(readings)
        self._tell_errors()
        return belief

    def _tell_errors(self) -> None:
        """The systematic errors with their standard deviations, one after the other."""
        values = self._pose[augmented.POSE :].tolist()
        stds = np.sqrt(np.diagonal(self._cov)[augmented.POSE :]).tolist()
        self._errors.tell(*(number for pair in zip(values, stds, strict=True) for number in pair))

    @property
    def _bearing_offset_rad(self) -> float:
        return float(self._pose[augmented.BEARING_OFFSET])

    def _predict(
        self, state: FloatArray, cov: FloatArray, distance: float, angle: float, Q: FloatArray, exact: bool
    ) -> None:
        augmented.predict(state, cov, distance, angle, self._since_s, Q, self._walk, exact)
