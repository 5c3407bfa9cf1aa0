"""What a state of a navigator is, what a step in one comes to, and the last one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from pilotage.core.types import STOP, Twist
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


@dataclass(frozen=True, slots=True)
class Ended:
    """Stands still for good: it has arrived, or failed."""

    def step(self, readings: Readings, belief: Belief) -> Move:  # noqa: ARG002 - nothing matters any more
        """Stay."""
        return Move(self, STOP)
