"""What the explorer is about, one class each: where it goes for that, and how near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig
from pilotage.stack.navigator.floor_explorer.targets import Target


@dataclass(frozen=True, slots=True)
class Exploring:
    """Goes to look at a frontier, or through it; without a target it looks for one."""

    target: Target | None = None

    def within_m(self, config: FloorExplorerConfig) -> float:
        """How near it comes."""
        crossing = self.target is not None and self.target.crossing
        return config.cross_m if crossing else config.look_m


@dataclass(frozen=True, slots=True)
class Closing:
    """Goes back to a place that it knows well, for the localizer to close a loop there."""

    target: Target

    def within_m(self, config: FloorExplorerConfig) -> float:
        """How near it comes."""
        return config.look_m


@dataclass(frozen=True, slots=True)
class Returning:
    """Comes back to its start; there without a target, it makes sure of that."""

    target: Target | None = None

    def within_m(self, config: FloorExplorerConfig) -> float:
        """How near it comes."""
        return config.arrival_m


@dataclass(frozen=True, slots=True)
class Done:
    """Stands: it is back, or has failed."""

    target: None = None

    def within_m(self, config: FloorExplorerConfig) -> float:  # noqa: ARG002 - it goes nowhere
        """Of nothing."""
        return 0.0


State: TypeAlias = Exploring | Closing | Returning | Done
