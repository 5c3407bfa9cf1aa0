"""Dead reckoning: odometry alone, with the covariance that it earns."""

from __future__ import annotations

from typing import Literal

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import Pose2
from pilotage.kernels.filters import rover_odometry
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel, chord
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryNoise, OdometryPrediction
from pilotage.stack.localization.odometry_watch import OdometryWatch, increment_of


class DeadReckoningConfig(Config):
    """Which odometry model, the noise that the covariance grows by, and how it grows.

    Second order, it is the exact mean square error about the path that was driven; the odometry model is the
    exact arc then.
    """

    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryNoise = OdometryNoise()
    odometry_var_scale: Positive = 1.0
    covariance: Literal["first-order", "second-order"] = "first-order"


@LOCALIZERS.add("dead-reckoning", DeadReckoningConfig)
class DeadReckoningLocalizer:
    """Integrates odometry (night-watch report eq. 1-3 or the exact arc; rover report 4.1).

    Fails slowly: errors grow without bound, and the linear covariance is too small once the heading is
    uncertain by more than about 0.15 rad; second order, the 95 % ellipse holds the truth in 94 to 95 % of the
    time.
    """

    def __init__(
        self,
        config: DeadReckoningConfig,
        robot: RobotKnowledge,
        chart: WorldMap,  # noqa: ARG002 - it needs no map
        initial: Belief,
        journal: Journal,  # noqa: ARG002 - nothing to tell beyond the belief
    ) -> None:
        require_initial_pose(initial, "dead-reckoning")
        self._odometry, sensor = robot.one_sensor(WheelOdometryConfig, "dead-reckoning")
        self._prediction = OdometryPrediction(
            sensor, config.odometry, config.odometry_var_scale, config.odometry_model
        )
        self._watch = OdometryWatch(robot, sensor)
        self.belief = initial
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()
        self._second = config.covariance == "second-order"
        self._sums = np.zeros(rover_odometry.SUMS, dtype=np.complex128)
        self._sums[4] = complex(self._cov[0, 2], self._cov[1, 2])

    def step(self, readings: Readings) -> Belief:
        """Move by the odometry increment, if there is one."""
        odometry = increment_of(readings.by_sensor.get(self._odometry))
        if odometry is not None:
            if self._second:
                self._move_by_moments(odometry)
            else:
                self._prediction.move(self._pose, self._cov, odometry)
        widened = self._watch.widen(self._cov, readings.t_s, odometry)
        if odometry is not None or widened:
            self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy())
        return self.belief

    def _move_by_moments(self, odometry: OdometryIncrement) -> None:
        chord_m, aside_rad = chord(odometry.distance_m, odometry.angle_rad)
        variances = self._prediction.variances(odometry)
        rover_odometry.predict_second_order(
            self._pose, self._cov, self._sums, chord_m, aside_rad, odometry.angle_rad, *variances
        )
