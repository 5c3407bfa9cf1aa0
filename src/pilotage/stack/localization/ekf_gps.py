"""The EKF on position fixes, and a compass where there is one: for open ground without landmarks."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.config import Config
from pilotage.core.types import Pose2
from pilotage.kernels.filters import satellite
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.readings import CompassHeading, GpsFix, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction
from pilotage.stack.localization.odometry_watch import LINEAR_RAD, OdometryWatch
from pilotage.stack.localization.self_check import SelfCheck

NAME = "ekf-gps"
FIX_DOF = 2
LEAST_VAR = 1e-12
"""Of a measurement without noise: the filter divides by it."""
DISTURBANCE_SHARE = 0.5
"""Standard deviation of a compass's disturbance over its largest value, along a path."""
WIDENING = 2.0
"""A filter in doubt multiplies the standard deviations of the place by this until a fix passes."""
COLUMNS = {
    "fixes_seen": "1",
    "fixes_accepted": "1",
    "nis": "1",
    "nis_dof": "1",
    "nis_expected": "1",
    "localized": "1",
    "gps_offset_x_m": "m",
    "gps_offset_y_m": "m",
    "compass_offset_rad": "rad",
}


class EkfGpsConfig(Config):
    """The gate is a probability: the share of true readings that it lets through.

    What is left out is taken from the sensors' data sheets. Nobody tells a robot its compass's declination:
    ``declination_std_rad`` is what it holds possible.
    """

    gate: float = Field(default=0.999, gt=0.0, lt=1.0)
    position_std_m: Positive | None = None
    bias_std_m: NonNegative | None = None
    bias_time_s: Positive | None = None
    heading_std_rad: Positive | None = None
    declination_std_rad: NonNegative = 0.05
    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryBelief = OdometryBelief()
    odometry_var_scale: Positive = 1.0
    doubt_after: int | None = Field(default=10, ge=1)
    """Fixes in a row that the gate refused, until the filter doubts itself and widens its place; None:
    never."""


@LOCALIZERS.add(NAME, EkfGpsConfig)
class EkfGpsLocalizer:
    """Extended Kalman filter on odometry, position fixes and compass headings.

    A receiver's error lasts a minute, a compass's some metres: taken for white noise, a hundred fixes at one
    spot would make the filter sure of a wrong place. Both are estimated (``kernels.filters.satellite``).

    Fails where the heading is uncertain by more than half a radian (and says so), and needs a pose to begin
    with. It never becomes surer of its place than the receiver's lasting error lets it.
    """

    BY_COMMANDS: ClassVar[bool] = True

    def __init__(
        self,
        config: EkfGpsConfig,
        robot: RobotKnowledge,
        chart: WorldMap,  # noqa: ARG002 - it needs no map
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, NAME)
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, NAME)
        self._gps, gps = robot.one_sensor(GpsConfig, NAME)
        self._antenna_m = gps.mount.x_m, gps.mount.y_m
        self._compass, heading_var, disturbance_rad, length_m = self._compass_of(robot, config)
        self._prediction = OdometryPrediction(
            odometry, config.odometry, config.odometry_var_scale, config.odometry_model, satellite.predict
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._fix_var = _var(config.position_std_m, gps.position_std_m)
        self._heading_var = heading_var
        offset_var = (gps.bias_std_m if config.bias_std_m is None else config.bias_std_m) ** 2
        self._stationary = np.array(
            [
                offset_var,
                offset_var,
                config.declination_std_rad**2,
                (DISTURBANCE_SHARE * disturbance_rad) ** 2,
            ]
        )
        self._keep = np.ones(4)
        self._time_s, self._length_m = config.bias_time_s or gps.bias_time_s, length_m
        self._gate = chi_square_quantile(config.gate, FIX_DOF)
        self._heading_gate = chi_square_quantile(config.gate, 1)
        self._expected_nis = gated_mean(self._gate, FIX_DOF)
        self._doubt_after, self._rejected = config.doubt_after, 0
        self._watch, self._check = OdometryWatch(robot, odometry), SelfCheck(config.gate)
        self._state = np.concatenate([initial.pose.as_array(), np.zeros(4)])
        self._cov = np.diag(np.concatenate([np.zeros(3), self._stationary]))
        self._cov[:3, :3] = initial.cov
        self._last_s: float | None = None
        self.belief = initial
        self._telemetry = journal.channel(COLUMNS)

    def _compass_of(self, robot: RobotKnowledge, config: EkfGpsConfig) -> tuple[str, float, float, float]:
        """Name, variance, disturbance and its length of the compass, if there is one."""
        found = robot.sensors_of(CompassConfig)
        if not found:
            return "", 1.0, 0.0, 1.0
        name, compass = robot.one_sensor(CompassConfig, NAME)
        var = _var(config.heading_std_rad, compass.heading_std_rad)
        return name, var, compass.disturbance_rad, compass.disturbance_length_m

    def step(self, readings: Readings) -> Belief:
        """Predict by the odometry increment, let the lasting errors age, then update by what was read."""
        odometry = self._motion.increment(readings, self.belief)
        if odometry is not None:
            self._prediction.move(self._state, self._cov, odometry)
        self._watch.widen(self._cov, readings.t_s, odometry, self.belief)
        since_s = 0.0 if self._last_s is None else max(readings.t_s - self._last_s, 0.0)
        driven_m = 0.0 if odometry is None else math.hypot(odometry.distance_m, odometry.lateral_m)
        self._last_s = readings.t_s
        self._keep[:2], self._keep[3] = (
            math.exp(-since_s / self._time_s),
            math.exp(-driven_m / self._length_m),
        )
        satellite.let_pass(self._state, self._cov, self._keep, self._stationary)
        heading = readings.by_sensor.get(self._compass) if self._compass else None
        if isinstance(heading, CompassHeading):
            satellite.update_heading(
                self._state, self._cov, heading.heading_rad, self._heading_var, self._heading_gate
            )
        fix = readings.by_sensor.get(self._gps)
        self._fix(fix, readings.t_s)
        status = BeliefStatus.LOST if self._is_lost(readings.t_s) else BeliefStatus.LOCALIZED
        self.belief = Belief(Pose2.from_array(self._state), self._cov[:3, :3].copy(), status)
        return self.belief

    def _is_lost(self, t_s: float) -> bool:
        return self._check.lost(t_s) or bool(self._cov[2, 2] > LINEAR_RAD**2)

    def _fix(self, fix: object, t_s: float) -> None:
        """Update by a fix, if one came, and tell."""
        seen = accepted = 0
        nis = expected = math.nan
        if isinstance(fix, GpsFix):
            seen = 1
            found = satellite.update_fix(
                self._state, self._cov, fix.x_m, fix.y_m, *self._antenna_m, self._fix_var, self._gate
            )
            if found <= self._gate:
                accepted, nis, expected, self._rejected = 1, found, self._expected_nis, 0
            else:
                self._rejected += 1
                if self._doubt_after is not None and self._rejected >= self._doubt_after:
                    self._check.alarm(t_s)
                    self._cov[:2] *= WIDENING
                    self._cov[:, :2] *= WIDENING
            self._check.tell(t_s, 1, accepted, found if accepted else 0.0, accepted * self._expected_nis)
        offset_x, offset_y, declination, disturbance = self._state[3:].tolist()
        localized = 0.0 if self._is_lost(t_s) else 1.0
        self._telemetry.tell(
            seen,
            accepted,
            nis,
            FIX_DOF * accepted,
            expected,
            localized,
            offset_x,
            offset_y,
            declination + disturbance,
        )


def _var(own: float | None, sheet: float) -> float:
    return max((sheet if own is None else own) ** 2, LEAST_VAR)
