"""The last word before a command leaves: it does not where a laser shows no room for it."""

from __future__ import annotations

import math

from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.control.scan_guard import NOTHING, ScanGuard
from pilotage.stack.knowledge import RobotKnowledge

AGAIN_S = 1.0
"""Refused again so soon it is for the same thing."""


class LastWord:
    """Says whether a command may leave; what to do where it may not is the navigator's own business.

    To be told of every step's readings, and asked about every command that is no stop: it reckons with what
    it allowed last as what the robot was told to do.

    Attributes
    ----------
    shown_m
        (K, 2) in the base frame what the lasers showed around the robot when it refused last.
    """

    def __init__(self, robot: RobotKnowledge) -> None:
        self._guard = ScanGuard(robot)
        self._left: Twist | None = None
        self._t_s = self._refused_s = 0.0
        self._since_s = math.inf
        self.shown_m: FloatArray = NOTHING

    def take_in(self, readings: Readings) -> None:
        """Begin a step with its readings."""
        if self._left is not None:
            self._guard.sent(self._left)
        self._left, self._t_s = STOP, readings.t_s
        self._guard.take_in(readings)

    def allows(self, command: Twist) -> bool:
        """Whether it may leave."""
        touched_m = self._guard.touched_m(command)
        if not len(touched_m):
            self._left = command
            return True
        self._left, self.shown_m = STOP, touched_m
        if self._t_s - self._refused_s > AGAIN_S:
            self._since_s = self._t_s
        self._since_s, self._refused_s = min(self._since_s, self._t_s), self._t_s
        return False

    @property
    def why(self) -> str:
        """What keeps it, in words."""
        return f"for {self.held_s:.0f} s its lasers have shown something where it would drive"

    @property
    def held_s(self) -> float:
        """For how long it has refused now, again and again; 0 where it did not just now."""
        held = self._t_s - self._refused_s <= AGAIN_S
        return max(self._t_s - self._since_s, 0.0) if held else 0.0
