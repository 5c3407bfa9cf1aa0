"""The last word before a command leaves: it does not where a laser shows no room for it."""

from __future__ import annotations

import math

from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.arc_stop import ArcStop
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.control.scan_guard import NOTHING, ScanGuard
from pilotage.stack.knowledge import RobotKnowledge

AGAIN_S, SAME_M = 1.0, 0.3
"""Refused again so soon, and so near to where it was refused first, it is for the same thing."""


class LastWord:
    """Says whether a command may leave; what to do where it may not is the navigator's own business.

    To be told of every step's readings, asked about every command that is no stop, and handed what leaves in
    the end, which it brakes along the arc where that is a stop. Who hands it nothing, as a robot on patrol,
    which sees to its stops itself, drives what it allowed last, by its reckoning.

    Attributes
    ----------
    shown_m
        (K, 2) in the base frame what the lasers showed around the robot when it refused last.
    """

    def __init__(self, robot: RobotKnowledge) -> None:
        self._brakes = Brakes(robot)
        self._guard, self._arc_stop = ScanGuard(robot, self._brakes), ArcStop(robot, self._brakes)
        self._left: Twist | None = None
        self._t_s = self._refused_s = 0.0
        self._since_s, self._since_at = math.inf, self._guard.place_m
        self.shown_m: FloatArray = NOTHING

    def take_in(self, readings: Readings) -> None:
        """Begin a step with its readings."""
        if self._left is not None:
            self._brakes.sent(self._left)
            self._guard.sent(self._left)
            self._arc_stop.sent(self._left)
        self._left, self._t_s = STOP, readings.t_s
        self._brakes.take_in(readings)
        self._guard.take_in(readings)
        self._arc_stop.take_in(readings)

    def allows(self, command: Twist) -> bool:
        """Whether it may leave: there is room for it, and for what the robot does next that is told so.

        One with weak brakes that is told to turn, or to go back, rolls on for a while.
        """
        touched_m = self._guard.touched_m(command)
        if not len(touched_m):
            rolls_on = self._arc_stop.follows(command)
            if rolls_on is not command and not _is_part(rolls_on, command):
                touched_m = self._guard.touched_m(rolls_on)
        if not len(touched_m):
            self._left = command
            return True
        self._left, self.shown_m = STOP, touched_m
        elsewhere = math.dist(self._since_at, self._guard.place_m) > SAME_M
        if elsewhere or self._t_s - self._refused_s > AGAIN_S:
            self._since_s, self._since_at = self._t_s, self._guard.place_m
        self._since_s, self._refused_s = min(self._since_s, self._t_s), self._t_s
        return False

    @property
    def rolls_on(self) -> bool:
        """Whether it takes the robot longer than a step to stop: what is refused may be its speed alone."""
        return self._arc_stop.rolls_on

    def no_faster(self, command: Twist) -> tuple[Twist, ...]:
        """What to ask about instead of a refused command while the robot rolls, the most like it first."""
        return self._arc_stop.no_faster(command)

    def leaving(self, command: Twist) -> Twist:
        """What leaves in this step for a command: itself, or of a stop the braking along the arc."""
        self._left = self._arc_stop.leaving(command)
        return self._left

    @property
    def why(self) -> str:
        """What keeps it, in words."""
        return f"for {self.held_s:.0f} s its lasers have shown something where it would drive"

    @property
    def held_s(self) -> float:
        """For how long it has refused now, again and again in one place; 0 where it did not just now."""
        held = self._t_s - self._refused_s <= AGAIN_S
        return max(self._t_s - self._since_s, 0.0) if held else 0.0


def _is_part(one: Twist, whole: Twist) -> bool:
    """Whether one is the other but slower, along the same arc."""
    share = one.v_m_s / whole.v_m_s if whole.v_m_s != 0.0 else -1.0
    return 0.0 <= share <= 1.0 and one == Twist(one.v_m_s, share * whole.w_rad_s, share * whole.lateral_m_s)
