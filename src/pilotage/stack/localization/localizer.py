"""The role: readings in, belief out; and the registry of those who fill it."""

from __future__ import annotations

from typing import Protocol

from pilotage.core.errors import InputError
from pilotage.core.registry import Registry
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus


class Localizer(Protocol):
    """Estimates the pose.

    Built as ``cls(config, robot: RobotKnowledge, chart: WorldMap, initial: Belief, journal: Journal)``. It
    declares its telemetry in the journal at construction and tells it at every step; an update that it can
    explain it puts into ``journal.update``.

    One that knows, while it is lost, where to look has a method ``look_bearing_rad() -> float | None``
    besides: the direction, in the robot's frame, worth driving in, None where any is as good. Whether it
    has is asked once, when the stack is put together. So is whether it has ``tell_mates(mates)``:
    told before each step where mates say that they are, (K, 4) as of ``ScanFit.mates_in_sight``.
    """

    @property
    def belief(self) -> Belief:
        """The current belief."""
        ...

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings and return the belief after them."""
        ...


def require_initial_pose(initial: Belief, name: str) -> None:
    """Refuse a start without a pose.

    Raises
    ------
    InputError
        If the initial pose is unknown; said by localizers that cannot find it by themselves.
    """
    if initial.status is BeliefStatus.LOST:
        raise InputError(
            f"{name}: expected an initial pose, found stack.initial.known = false; set it to true or take "
            "a localizer that finds its pose by itself, such as ekf-walls"
        )


LOCALIZERS: Registry[Localizer] = Registry("localizer", "pilotage.stack.localization", "pilotage.replicas")
