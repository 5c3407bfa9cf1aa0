"""Between two increments of the odometry: the belief goes on as commanded, and readings wait for theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import ekf
from pilotage.sensors.bumper import BumperConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.readings import OdometryIncrement, Reading, Readings
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.command_error import CommandError
from pilotage.stack.localization.commanded_motion import CommandedMotion
from pilotage.stack.localization.localizer import Localizer, WrappedLocalizer
from pilotage.stack.localization.odometry_watch import LINEAR_RAD, MOST_HEADING_VAR

NOT_OF_THE_POSE = (
    BumperConfig,
    GyroscopeConfig,
    ImuConfig,
    InfraredConfig,
    LineSensorConfig,
    RadioConfig,
    UltrasonicConfig,
    WheelEncodersConfig,
    WheelOdometryConfig,
)
"""Sensors by which no localizer corrects the pose; of all others it matters where they were read."""


class BetweenIncrements(WrappedLocalizer):
    """Carries a localizer's belief on between increments, and tells it what was read with their shares.

    The localizer is always at the last increment. Until the next one the belief is its prediction, step by
    step as foretold by commands: x <- f(x, u), P <- F P F' + G (q dt) G' with the densities q of
    ``CommandError`` (by controls: Thrun et al. 2005, section 5.3). Nothing of it is told to the localizer.

    When the increment comes each step of it gets what was foretold, and an even share of what is left: the
    mean of a white error whose sum is known (a Brownian bridge). Each reading that waited is told at its own
    step: a scan that comes 0.1 s after the odometry was seen from 5 cm farther on. Where between both
    increments that was is uncertain: of a piece of time t from one reading of the world to the next by
    q t (1 - t / T), which the localizer adds (``part_var``). That the pieces make up for each other it is not
    told, and is a little too cautious.

    Where an increment is late nothing waits: the localizer widens its belief by what may have been driven.
    Fails where the robot does other than told, until the first increment that says so.
    """

    def __init__(
        self, localizer: Localizer, odometry: str, sensor: WheelOdometryConfig, robot: RobotKnowledge
    ) -> None:
        super().__init__(localizer)
        self._odometry, self._dt_s = odometry, robot.dt_s
        self._waits_s = 1.0 / sensor.rate_hz - 0.5 * robot.dt_s
        self._sideways = robot.motion.drives_sideways
        self.commanded = CommandedMotion(robot.motion, robot.dt_s)
        self._error = CommandError(robot.motion, sensor)
        outward = robot.sensors.items() if self.corrects else ()
        self._outward = {name for name, sheet in outward if not isinstance(sheet, NOT_OF_THE_POSE)}
        self._held: list[tuple[Readings, FloatArray]] = []
        self._commanded = np.zeros(3)
        self._last_s: float | None = None
        self._carried: Belief | None = None

    @property
    def belief(self) -> Belief:
        """The localizer's, carried on to now."""
        return self._localizer.belief if self._carried is None else self._carried

    def step(self, readings: Readings) -> Belief:
        """Carry on and let wait, or tell what waited and this."""
        commanded = _array(self.commanded.step(readings.t_s))
        self._commanded = self._commanded + commanded
        moved = commanded + self._error.rates * self._dt_s
        first = self._last_s is None
        if self._last_s is None:
            self._last_s = readings.t_s - self._dt_s
        over_s = readings.t_s - self._last_s
        increment = readings.by_sensor.get(self._odometry)
        if isinstance(increment, OdometryIncrement):
            self._error.tell(increment, self._commanded, max(over_s, self._dt_s))
            self._catch_up([*self._held, (readings, moved)], increment)
            self._held, self._commanded, self._last_s = [], np.zeros(3), readings.t_s
        elif over_s < self._waits_s and not first:  # in its first step it has hardly begun to move
            self._held.append((readings, moved))
            self._carry_on(moved)
        else:
            for step, _ in self._held:
                self._localizer.step(step)
            self._held, self._carried = [], None
            self._localizer.step(readings)
        return self.belief

    def _catch_up(self, steps: list[tuple[Readings, FloatArray]], increment: OdometryIncrement) -> None:
        """Tell the localizer each step with its share of the increment."""
        count = len(steps)
        rest = (_array(increment) - sum(moved for _, moved in steps)) / count
        var, spread = increment.angle_var_rad2, self._error.densities * self._dt_s
        for (step, moved), piece in zip(steps, self._pieces(steps), strict=True):
            ahead_m, left_m, turn_rad = (moved + rest).tolist()
            part = spread * (1.0 - piece / count)
            share = replace(
                increment,
                distance_m=ahead_m,
                angle_rad=turn_rad,
                lateral_m=left_m if self._sideways else increment.lateral_m / count,
                angle_var_rad2=None if var is None else var / count,
                part_var=(float(part[0]), float(part[1]), float(part[2])),
            )
            said: dict[str, Reading] = {**step.by_sensor, self._odometry: share}
            self._localizer.step(Readings(step.t_s, said))
        self._carried = None

    def _pieces(self, steps: list[tuple[Readings, FloatArray]]) -> list[int]:
        """Of each step how many there are from one reading of the world to the next, itself among them."""
        lengths, since = [], 0
        for number, (step, _) in enumerate(steps, start=1):
            since += 1
            if number == len(steps) or not self._outward.isdisjoint(step.by_sensor):
                lengths += [since] * since
                since = 0
        return lengths

    def _carry_on(self, moved: FloatArray) -> None:
        """Predict the belief by one step."""
        belief = self.belief
        pose, cov = belief.pose.as_array(), belief.cov.copy()
        ahead_m, left_m, turn_rad = moved.tolist()
        along, aside, turn = (self._error.densities * self._dt_s).tolist()
        turn = min(turn, max(MOST_HEADING_VAR - float(cov[2, 2]), 0.0))
        ekf.predict(pose, cov, ahead_m, turn_rad, np.diag([along, turn]), True)
        if self._sideways:
            ekf.predict_sideways(pose, cov, left_m, turn_rad, aside, True)
        blind = bool(cov[2, 2] > LINEAR_RAD**2)
        self._carried = Belief(Pose2.from_array(pose), cov, BeliefStatus.LOST if blind else belief.status)


def in_between(localizer: Localizer, robot: RobotKnowledge) -> Localizer:
    """The localizer, carried on between increments where the odometry does not come at each step."""
    wheels = robot.sensors_of(WheelOdometryConfig)
    if len(wheels) != 1:
        return localizer
    ((name, odometry),) = wheels.items()
    # Rates that the steps do not bear are refused where the sensors are made, by their places in the mission.
    if odometry.rate_hz * robot.dt_s > 2.0 / 3.0:
        return localizer
    return BetweenIncrements(localizer, name, odometry, robot)


def _array(increment: OdometryIncrement) -> FloatArray:
    """(3,) ahead, to the left, turn."""
    return np.array([increment.distance_m, increment.lateral_m, increment.angle_rad])
