"""What the engine asks of whoever runs its tasks, on this machine or a cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from pilotage.experiments.studies.trial import Outcome, Task

AHEAD = 2
"""Tasks that a worker holds: the one it runs and the next."""
WAIT_S = 1.0
"""How long at most one look at the outcomes waits."""


@dataclass(frozen=True, slots=True)
class Running:
    """A trial that runs: its row, the process that runs it, and for how long."""

    row: int
    pid: int
    seconds: float


class Workers(Protocol):
    """Whoever runs tasks."""

    @property
    def room(self) -> int:
        """How many more tasks it takes now."""
        ...

    def give(self, task: Task) -> None:
        """Hand one task over."""
        ...

    def outcomes(self) -> Iterator[Outcome]:
        """What has ended since the last call; waits a moment where nothing has."""
        ...

    def running(self) -> Sequence[Running]:
        """What runs now, as far as it is known."""
        ...

    def stop(self) -> None:
        """Stop at once; what runs is lost."""
        ...
