"""What a state of the goal navigator is, and what a step in one comes to."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from pilotage.core.types import Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief


class State(Protocol):
    """What the robot is about; it holds nothing but what this state alone needs."""

    def step(self, readings: Readings, belief: Belief) -> Move:
        """One control step: the command, and the state that the next step begins in."""


class Move(NamedTuple):
    """The outcome of a step, or of a transition."""

    state: State
    command: Twist
