"""Dead reckoning: odometry alone, with the covariance that it earns."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.core.types import Pose2
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryNoise, OdometryPrediction


class DeadReckoningConfig(Config):
    """Which odometry model, and the noise that the covariance grows by."""

    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryNoise = OdometryNoise()
    odometry_var_scale: Positive = 1.0


@LOCALIZERS.add("dead-reckoning", DeadReckoningConfig)
class DeadReckoningLocalizer:
    """Integrates odometry (night-watch report eq. 1-3 or the exact arc); its covariance is linearized.

    Fails slowly: errors grow without bound, and the linear covariance is too small once the heading is
    uncertain by more than about 0.15 rad.
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
        self.belief = initial
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()

    def step(self, readings: Readings) -> Belief:
        """Move by the odometry increment, if there is one."""
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            self._prediction.move(self._pose, self._cov, odometry)
            self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy())
        return self.belief
