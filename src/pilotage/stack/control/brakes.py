"""How hard a robot brakes: as its data sheet says, or less, as it has proved so far."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import Twist
from pilotage.kernels.control.motion_limits import Drive
from pilotage.models.odometry import increment_variances
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.answer import DELAYS, SHARES, Answer
from pilotage.stack.control.own_motion import odometry_of_every_step
from pilotage.stack.knowledge import RobotKnowledge

WEAKER = (0.4, 0.3)
"""Shares that are looked for as well; local controllers lost time by them (decision 0425)."""
BETWEEN = 0.1
"""Two shares that are below 1."""
MISSED_STEPS = 1.5
"""It is told of every step, or begins anew."""
NOISE_STDS = 2.0
"""Who brakes by less than so many deviations of an odometry's speed in a step is told too little by it."""
SAME = 0.01
"""Of top speed, by which commands differ that are one and the same here."""


class Brakes:
    """Learns what share of its data sheet's braking a robot has, where an odometry tells at every step.

    Who speeds up more slowly than its data sheet says brakes more weakly as well (``Answer``): it knows
    before it has to brake. Turn rates tell nothing here: they have limits of their own, or follow the
    steering. Who brakes within a step has nothing to learn, nor who has been told one speed for so long that
    it has come to it whatever its share.

    Attributes
    ----------
    likely_m_s2
        What it brakes with, it seems, and at most what its data sheet says.
    sure_m_s2
        What it can be relied on for: as a share between two hypotheses may be told as the higher one, the
        next lower one than what seems likely; as long as that is what its data sheet says, that.
    knows_its_speed_better
        Whether ``rates_m_s`` are nearer to the truth than the odometry of a step: it takes several steps to
        brake by what that may be off.
    """

    def __init__(self, robot: RobotKnowledge) -> None:
        motion, dt_s = robot.motion, robot.dt_s
        top_m_s = motion.top_speed_m_s
        most = min(motion.braking_m_s2, top_m_s / dt_s)
        self.likely_m_s2 = self.sure_m_s2 = self._most_m_s2 = most
        # Sideways it brakes as well as ahead: its lateral speed takes the place of the turn rate.
        self._drive = Drive(top_m_s, top_m_s, most, most, motion.top_lateral_m_s, most)
        self._odometry = odometry_of_every_step(robot) if most * dt_s < top_m_s else None
        self._answer, self._t_s = _answer(), 0.0
        self.knows_its_speed_better = self._odometry is not None and most * dt_s < NOISE_STDS * _speed_std(
            top_m_s, dt_s, self._odometry[1]
        )
        self._delay_s, self._dt_s = motion.delay_s, dt_s
        self._settles_s = top_m_s / (WEAKER[-1] * most) + DELAYS[-1] * motion.delay_s
        self._told, self._told_s, self._same_m_s = (0.0, 0.0), 0.0, SAME * top_m_s

    @property
    def rates_m_s(self) -> tuple[float, float]:
        """Its speeds ahead and to the left when it last learned."""
        ahead_m_s, lateral_m_s = self._answer.rates.tolist()
        return ahead_m_s, lateral_m_s

    def take_in(self, readings: Readings) -> None:
        """Begin a step with its readings."""
        if self._odometry is None:
            return
        if readings.t_s - self._t_s > MISSED_STEPS * self._dt_s:
            self._answer = _answer()
        self._t_s = readings.t_s
        if self._t_s - self._told_s > self._settles_s:
            return
        name, sheet = self._odometry
        told = readings.by_sensor.get(name)
        if not isinstance(told, OdometryIncrement):
            return
        moved_m = np.array([told.distance_m, told.lateral_m])
        var_m2 = np.array(
            [increment_variances(way_m, told.angle_rad, *sheet.densities)[0] for way_m in moved_m.tolist()]
        )
        dt_s = self._dt_s
        self._answer.learn(readings.t_s, moved_m / dt_s, var_m2 / dt_s**2, self._delay_s, self._drive)
        share = min(self._answer.share, 1.0)
        self.likely_m_s2 = share * self._most_m_s2
        self.sure_m_s2 = (share if share == 1.0 else share - BETWEEN) * self._most_m_s2

    def sent(self, command: Twist) -> None:
        """A command left in this step."""
        if self._odometry is None:
            return
        self._answer.sent(self._t_s, command.v_m_s, command.lateral_m_s)
        ahead_m_s, lateral_m_s = self._told
        if math.hypot(command.v_m_s - ahead_m_s, command.lateral_m_s - lateral_m_s) > self._same_m_s:
            self._told, self._told_s = (command.v_m_s, command.lateral_m_s), self._t_s


def _speed_std(v_m_s: float, dt_s: float, sheet: WheelOdometryConfig) -> float:
    """Of a speed that an odometry tells of one step (m/s)."""
    return math.sqrt(increment_variances(v_m_s * dt_s, 0.0, *sheet.densities)[0]) / dt_s


def _answer() -> Answer:
    """One that remembers: a robot may drive at one speed for long, and has to brake at the end."""
    return Answer(SHARES + WEAKER, holds_on=True)
