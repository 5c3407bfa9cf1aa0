"""What navigators show of themselves, and what those that are state machines share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

from pilotage.core.types import STOP, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.localization.localizer import Localizer


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


class Standing:
    """How the task stands as the robot sees it, and why: part of what its states share, if it has any."""

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.status, self.reason = StackStatus.RUNNING, ""

    def end(self, t_s: float, status: StackStatus, why: str) -> None:
        """Arrive or fail, and say so."""
        self.status, self.reason = status, why
        self.journal.say(t_s, str(status), why)

    @property
    def is_over(self) -> bool:
        """Whether it has arrived or failed."""
        return self.status is not StackStatus.RUNNING


class LocalizingNavigator:
    """What navigators show of themselves: their localizer's belief, and how the task stands."""

    def __init__(self, localizer: Localizer, standing: Standing) -> None:
        self._localizer, self._standing = localizer, standing

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Running, arrived or failed, and why."""
        return self._standing.status, self._standing.reason
