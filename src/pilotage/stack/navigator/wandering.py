"""What a robot does that does not know where it is: drive about safely, where its localizer wants to look."""

from __future__ import annotations

import math
from collections.abc import Callable

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.shunting import Shunting
from pilotage.stack.control.step_clear import StepClear
from pilotage.stack.control.wander import WanderConfig, Wanderer
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import Abilities, Localizer

LED_S, FREE_S = 15.0, 10.0
"""It is led for so long, then goes where it likes: what stands in the way may be on no map."""
ELSEWHERE_S = 1.0
"""Where a laser shows no room it turns for so long before it drives on,"""
SHUNTS_S = 4.0
"""and a car for so long: a leg of its takes as long."""


class Wandering:
    """Wanders by the scanner, into nothing that a laser shows; without one the robot stands still.

    Where corners have no room to turn either way it steps clear.

    A car, which cannot turn on the spot, does so ahead and back (``Shunting``).

    Attributes
    ----------
    plan_at_s
        When to plan, once it is found.
    """

    def __init__(
        self, config: WanderConfig, robot: RobotKnowledge, localizer: Localizer, last_word: LastWord
    ) -> None:
        self._wanderer, self._last_word = Wanderer.of(config, robot), last_word
        self._look = Abilities.of(localizer).look_bearing_rad
        self._turn_rad_s = config.max_turn_rate_rad_s
        self._least_m = robot.motion.least_turning_radius_m
        self._shunting = Shunting(robot, last_word.allows) if self._least_m > 0.0 else None
        self._shunts = False
        self._step_clear = StepClear(robot, last_word)
        self._elsewhere_until_s = -math.inf
        self.plan_at_s = 0.0

    def step(self, readings: Readings) -> Twist:
        """Choose a command, led by the localizer where it knows what would help."""
        return self._led(readings, self._look)

    def make_for(self, there_m: FloatArray | None, pose: Pose2, readings: Readings) -> Twist:
        """Choose a command, led to a place (2,) where there is one: it knows where it is."""
        if there_m is None:
            return self.step(readings)
        x, y = there_m - (pose.x_m, pose.y_m)
        return self._led(readings, lambda: wrap_to_pi(math.atan2(y, x) - pose.theta_rad))

    def _led(self, readings: Readings, bearing_rad: Callable[[], float | None]) -> Twist:
        if self._wanderer is None:
            return STOP
        led = readings.t_s % (LED_S + FREE_S) < LED_S
        command = self._wanderer.step(readings, bearing_rad() if led else None)
        if self._shunting is not None:
            return self._steered(self._shunting, readings.t_s, command)
        if readings.t_s >= self._elsewhere_until_s:
            if self._last_word.allows(command):
                return command
            if readings.t_s - self._elsewhere_until_s > ELSEWHERE_S:
                # Else on in the sense in which it turned: it would waver before what it turns away from.
                self._turn_rad_s = math.copysign(self._turn_rad_s, command.w_rad_s)
            self._elsewhere_until_s = readings.t_s + ELSEWHERE_S
        return self._turns(readings.t_s)

    def _steered(self, shunting: Shunting, t_s: float, command: Twist) -> Twist:
        """The command as a car can drive it: turns, and what its lasers show no room for, by shunting."""
        most = command.v_m_s / self._least_m
        bent = Twist(command.v_m_s, min(max(command.w_rad_s, -most), most))
        if command.v_m_s > 0.0 and t_s >= self._elsewhere_until_s and self._last_word.allows(bent):
            self._shunts = False
            return bent
        if not self._shunts:
            self._shunts = True
            self._turn_rad_s = math.copysign(self._turn_rad_s, command.w_rad_s)
            shunting.begin()
        if command.v_m_s > 0.0 and t_s >= self._elsewhere_until_s:
            self._elsewhere_until_s = t_s + SHUNTS_S
        return shunting.step(self._turn_rad_s)

    def _turns(self, t_s: float) -> Twist:
        """On the spot, the other way round where corners have no room for this one; else a step clear."""
        for turn in (Twist(0.0, self._turn_rad_s), Twist(0.0, -self._turn_rad_s)):
            if self._last_word.allows(turn):
                self._turn_rad_s = turn.w_rad_s
                return turn
        return self._step_clear.instead_of(Twist(0.0, self._turn_rad_s), t_s)
