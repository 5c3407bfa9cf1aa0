"""A plugin: a localizer that believes the last fix, and the odometry's heading."""

from __future__ import annotations

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import GpsFix, OdometryIncrement, Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS


class LastFixConfig(Config):
    """How sure it is."""

    position_std_m: Positive = 0.02
    heading_std_rad: Positive = 0.05


@LOCALIZERS.add("last-fix", LastFixConfig)
class LastFixLocalizer:
    """Position of the last fix, heading by odometry."""

    def __init__(
        self,
        config: LastFixConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        del robot, chart
        self.belief = initial
        variances = [config.position_std_m**2, config.position_std_m**2, config.heading_std_rad**2]
        self._cov = np.diag(variances)
        self._channel = journal.channel({"fixes": "1"})
        self._fixes = 0

    def step(self, readings: Readings) -> Belief:
        """Take in what arrived."""
        x, y, theta = self.belief.pose.as_array().tolist()
        for reading in readings.by_sensor.values():
            if isinstance(reading, OdometryIncrement):
                theta = wrap_to_pi(theta + reading.angle_rad)
            elif isinstance(reading, GpsFix):
                x, y = reading.x_m, reading.y_m
                self._fixes += 1
        self._channel.tell(float(self._fixes))
        self.belief = Belief(Pose2(x, y, theta), self._cov.copy())
        return self.belief
