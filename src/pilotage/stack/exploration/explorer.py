"""The role: an exploring robot's whole stack, readings in and wheel speeds out; and its registry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from pilotage.core.registry import Registry
from pilotage.core.types import BoolArray, Event, WheelSpeeds
from pilotage.maps.cell_map import CellMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, StackStatus


@dataclass(frozen=True, slots=True)
class LeftCell:
    """A cell that the explorer leaves unvisited, and why: unreachable, too narrow, blocked, ..."""

    row: int
    column: int
    reason: str


class Explorer(Protocol):
    """Explores a sheet and maps it. Built as ``cls(config, knowledge)``, a ``SheetKnowledge``."""

    @property
    def belief(self) -> Belief:
        """Where it believes to be."""
        ...

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Running; arrived: it is done; failed: it gave up; and why."""
        ...

    @property
    def cells(self) -> CellMap:
        """The cell map as the robot would print it now, row 0 at the sheet's lower edge."""
        ...

    @property
    def visited(self) -> BoolArray:
        """(rows, columns) the robot's own visited layer; marks of other layers do not overwrite it."""
        ...

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """Cells that it gave up, once it is done."""
        ...

    def step(self, readings: Readings) -> WheelSpeeds:
        """Take in what the sensors said in one control period, give the next command."""
        ...

    def telemetry(self) -> Mapping[str, float]:
        """Numbers of the last step worth recording; the same keys at every step."""
        ...

    def drain_events(self) -> list[Event]:
        """Events since the last call."""
        ...


EXPLORERS: Registry[Explorer] = Registry("explorer", "pilotage.stack.exploration")
