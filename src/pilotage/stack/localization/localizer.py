"""The role: readings in, belief out; and the registry of those who fill it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from pilotage.core.registry import Registry
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief


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


LOCALIZERS: Registry[Localizer] = Registry("localizer", "pilotage.stack.localization")
