"""The end of the task: arrived, or failed."""

from __future__ import annotations

from pilotage.core.types import STOP
from pilotage.stack.interface import StackStatus
from pilotage.stack.navigator.goal.context import Context
from pilotage.stack.navigator.goal_config import Mode
from pilotage.stack.navigator.state import Ended, Move


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
