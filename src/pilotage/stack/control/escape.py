"""The role of escape: a way out where turning does not help; and its registry."""

from __future__ import annotations

from typing import Protocol

from pilotage.core.checked import Gives, there
from pilotage.core.misfit import misfit
from pilotage.core.registry import Registry
from pilotage.core.types import Pose2, Twist


class Escape(Protocol):
    """Gets the robot out of a trap. Built as ``cls(config, robot: RobotKnowledge)``."""

    def begin(self, trail: list[Pose2]) -> None:
        """Start an escape; ``trail`` is the way the robot came by, oldest first, for the escape to use up."""

    def step(self, pose: Pose2) -> Twist | None:
        """Give the next command, or None when the escape is over."""


def _unfit(given: object, *_: object) -> str:
    return "" if given is None else misfit(given, Twist)


ESCAPES: Registry[Escape] = Registry(
    "escape",
    "pilotage.stack.control",
    gives=(there("begin"), Gives("step", "a Twist of finite numbers, or None", _unfit)),
)
