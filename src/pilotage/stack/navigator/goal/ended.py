"""The end of the task: arrived, or failed."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import STOP
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.navigator.goal.context import Context
from pilotage.stack.navigator.goal.state import Move
from pilotage.stack.navigator.goal_config import Mode


@dataclass(frozen=True, slots=True)
class Ended:
    """Stands still for good."""

    def step(self, readings: Readings, belief: Belief) -> Move:  # noqa: ARG002 - nothing matters any more
        """Stay."""
        return Move(self, STOP)


def arrive(context: Context) -> Move:
    """The last goal is reached."""
    context.status, context.mode = StackStatus.ARRIVED, Mode.ARRIVED
    context.say("arrived", "the robot says that it has reached its goal")
    return Move(Ended(), STOP)


def fail(context: Context, why: str) -> Move:
    """Give up."""
    context.status, context.reason = StackStatus.FAILED, why
    context.say("failed", why)
    return Move(Ended(), STOP)
