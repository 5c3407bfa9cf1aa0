"""The role of reactive control: what is near in, a change of the command out; and its registry."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from pilotage.core.checked import Gives, there
from pilotage.core.misfit import misfit
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.readings import Readings


class ReactionKind(StrEnum):
    """What the reaction asks of the robot."""

    NONE = "none"
    LATERAL = "lateral"
    HALL = "hall"
    AVOID = "avoid"
    TRAPPED = "trapped"


@dataclass(frozen=True, slots=True)
class Reaction:
    """What to do about what is near.

    ``LATERAL`` adds ``w_rad_s`` to the command; ``HALL`` and ``AVOID`` replace the turn rate by it and limit
    the speed to ``speed_limit_m_s``; ``TRAPPED`` says that turning does not help.
    """

    kind: ReactionKind
    w_rad_s: float
    speed_limit_m_s: float
    front_m: float


class Reactive(Protocol):
    """Reacts to what is near. Built as ``cls(config, robot: RobotKnowledge)``."""

    def reset(self) -> None:
        """Forget an avoidance in progress."""

    def step(
        self, readings: Readings, pose: Pose2, walls: NearWalls, circles_m: FloatArray, straight: bool
    ) -> Reaction:
        """React to one step's readings.

        Parameters
        ----------
        walls, circles_m
            What the current plan already takes into account; returns it explains need no avoidance.
        straight
            Whether the plan goes straight on for the next metre or so.
        """


def _unfit(given: object, *_: object) -> str:
    wrong = misfit(given, Reaction, unlimited=("speed_limit_m_s", "front_m"))
    if wrong or not isinstance(given, Reaction) or given.speed_limit_m_s >= 0.0:
        return wrong
    return f"Reaction with speed_limit_m_s {given.speed_limit_m_s}"


REACTIVES: Registry[Reactive] = Registry(
    "reactive",
    "pilotage.stack.control",
    gives=(there("reset"), Gives("step", "a Reaction of numbers", _unfit)),
)
