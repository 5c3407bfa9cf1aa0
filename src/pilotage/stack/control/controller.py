"""The role of path follower: estimate and reference in, twist out; and its registry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pilotage.core.checked import Gives, there
from pilotage.core.misfit import misfit
from pilotage.core.registry import Registry
from pilotage.core.types import Pose2, Twist


@dataclass(frozen=True, slots=True)
class Control:
    """A command and the parts it is made of."""

    twist: Twist
    error_m: float
    proportional_rad_s: float
    integral_rad_s: float


class Controller(Protocol):
    """Follows a moving reference. Built as ``cls(config, robot: RobotKnowledge)``.

    One that cannot catch up with it, and needs a local plan from the estimate, says so by a class attribute
    ``NEEDS_LOCAL_PLAN = True``.
    """

    def reset(self) -> None:
        """Forget the past: the robot was moved by something else meanwhile."""

    def step(self, pose: Pose2, reference: Pose2, feedforward: Twist) -> Control:
        """Give the command that follows ``reference`` from the estimated ``pose``."""


CONTROLLERS: Registry[Controller] = Registry(
    "controller",
    "pilotage.stack.control",
    gives=(
        there("reset"),
        Gives("step", "a Control of finite numbers", lambda given, *_: misfit(given, Control)),
    ),
)
