"""Dead reckoning: odometry alone, with the covariance that it earns."""

from __future__ import annotations

import cmath
from typing import Literal

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import bent_region, rover_odometry
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel, chord
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction
from pilotage.stack.localization.odometry_watch import OdometryWatch
from pilotage.stack.localization.region_columns import REGION_COLUMNS


class DeadReckoningConfig(Config):
    """Which odometry model, the noise that the covariance grows by, and how it grows.

    Second order, it is the exact mean square error about the path that was driven; the odometry model is the
    exact arc then, and the bent region that holds the position is told besides.
    """

    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryBelief = OdometryBelief()
    odometry_var_scale: Positive = 1.0
    covariance: Literal["first-order", "second-order"] = "first-order"


class PathKept:
    """The path as the region needs it, which it tells at each step."""

    def __init__(self, cov: FloatArray, journal: Journal) -> None:
        self._channel = journal.channel(REGION_COLUMNS)
        self._moves = np.zeros(bent_region.KNOTS, dtype=np.complex128)
        self._knots, self._count = np.zeros((bent_region.KNOTS, bent_region.KNOT)), 0
        self._sums = np.zeros(bent_region.SUMS, dtype=np.complex128)
        self._sums[2] = complex(cov[0, 2], cov[1, 2])
        self._region = np.empty(bent_region.REGION)
        self.widen(cov)

    def widen(self, cov: FloatArray) -> None:
        """An error of the position that no move explains."""
        self._sums[0] += cov[0, 0] + cov[1, 1]
        self._sums[1] += complex(cov[0, 0] - cov[1, 1], 2.0 * cov[0, 1])
        self._tell()

    def add(self, move: complex, heading_var: float, q_distance: float) -> None:
        """Add a step, told along the measured headings."""
        self._count = bent_region.add_move(
            self._moves, self._knots, self._sums, self._count, move, heading_var, q_distance
        )
        self._tell()

    def _tell(self) -> None:
        bent_region.region(self._moves, self._knots, self._sums, self._count, self._region)
        self._channel.tell(*self._region.tolist())


@LOCALIZERS.add("dead-reckoning", DeadReckoningConfig)
class DeadReckoningLocalizer:
    """Integrates odometry (night-watch report eq. 1-3 or the exact arc; rover report 4.1).

    Fails slowly: errors grow without bound, and the linear covariance is too small once the heading is
    uncertain by more than about 0.15 rad; second order, the error is bent: what holds the position as often
    as it says is the region of ``kernels/filters/bent_region.py``, told in the columns ``REGION_COLUMNS``.
    """

    corrects = on_map = False

    def __init__(
        self,
        config: DeadReckoningConfig,
        robot: RobotKnowledge,
        chart: WorldMap,  # noqa: ARG002 - it needs no map
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, "dead-reckoning")
        self._odometry, sensor = robot.one_sensor(WheelOdometryConfig, "dead-reckoning")
        self._prediction = OdometryPrediction(
            sensor, config.odometry, config.odometry_var_scale, config.odometry_model
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._watch = OdometryWatch(robot, sensor)
        self.belief = initial
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()
        self._second = config.covariance == "second-order"
        self._sums = np.zeros(rover_odometry.SUMS, dtype=np.complex128)
        self._sums[4] = complex(self._cov[0, 2], self._cov[1, 2])
        self._path = PathKept(self._cov, journal) if self._second else None

    def step(self, readings: Readings) -> Belief:
        """Move by the odometry increment, if there is one."""
        odometry = self._motion.increment(readings, self.belief)
        if odometry is not None:
            if self._second:
                self._move_by_moments(odometry)
            else:
                self._prediction.move(self._pose, self._cov, odometry)
        before = self._cov.copy()
        widened = self._watch.widen(self._cov, readings.t_s, odometry, self.belief)
        if widened and self._path is not None:
            self._path.widen(self._cov - before)
        if odometry is not None or widened:
            self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy())
        return self.belief

    def _move_by_moments(self, odometry: OdometryIncrement) -> None:
        chord_m, aside_rad = chord(odometry.distance_m, odometry.angle_rad, odometry.lateral_m)
        q_distance, q_turn = self._prediction.variances(odometry)
        q_distance += self._prediction.lateral_variance(odometry)
        if self._path is not None:
            move = cmath.rect(chord_m, float(self._pose[2]) + aside_rad)
            self._path.add(move, float(self._cov[2, 2]), q_distance)
        rover_odometry.predict_second_order(
            self._pose, self._cov, self._sums, chord_m, aside_rad, odometry.angle_rad, q_distance, q_turn
        )
