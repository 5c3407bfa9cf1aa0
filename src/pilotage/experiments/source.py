"""Where readings come from, and the one loop between a source and what runs on its robots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from pilotage.core.types import STOP, Command
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Stack


class ReadingSource(Protocol):
    """A simulator, a recording, or a live robot."""

    @property
    def t_s(self) -> float:
        """Time of the last readings, seconds since the begin."""

    @property
    def is_over(self) -> bool:
        """Whether nothing more will come."""

    def step(self, commands: Sequence[Command]) -> Sequence[Readings]:
        """Carry out one command a robot, as far as it can, and return what each robot's sensors say."""


def stepped(
    source: ReadingSource, stacks: Sequence[Stack]
) -> Iterator[tuple[Sequence[Readings], list[Command]]]:
    """Step source and stacks in turn until the source is over, or whoever asks has seen enough.

    Yields after each step every robot's readings and the command that its stack gave on them; the list of
    commands is the same one each time.
    """
    commands: list[Command] = [STOP] * len(stacks)
    while not source.is_over:
        readings = source.step(commands)
        for index, stack in enumerate(stacks):
            commands[index] = stack.step(readings[index])
        yield readings, commands
