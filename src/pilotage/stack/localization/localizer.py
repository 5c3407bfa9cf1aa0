"""The role: readings in, belief out; and the registry of those who fill it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from pilotage.core.errors import InputError
from pilotage.core.registry import Registry
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.knowledge import Knowledge


class Localizer(Protocol):
    """Estimates the pose. Built as ``cls(config, knowledge)``."""

    @property
    def belief(self) -> Belief:
        """The current belief."""
        ...

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings and return the belief after them."""
        ...

    def telemetry(self) -> Mapping[str, float]:
        """Numbers of the last step; the same keys at every step."""
        ...


@runtime_checkable
class Seeker(Protocol):
    """A localizer that, while it is lost, knows where to look."""

    @property
    def look_bearing_rad(self) -> float | None:
        """Direction, in the robot's frame, worth driving in; None where any is as good."""
        ...


def require_initial_pose(knowledge: Knowledge, name: str) -> None:
    """Refuse a start without a pose.

    Raises
    ------
    InputError
        If the initial pose is unknown; said by localizers that cannot find it by themselves.
    """
    if knowledge.initial.status is BeliefStatus.LOST:
        raise InputError(
            f"{name}: expected an initial pose, found stack.initial.known = false; set it to true or take "
            "a localizer that finds its pose by itself, such as ekf-walls"
        )


LOCALIZERS: Registry[Localizer] = Registry("localizer", "pilotage.stack.localization")
