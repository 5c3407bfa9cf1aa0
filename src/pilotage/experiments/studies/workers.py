"""What the engine asks of whoever runs its tasks, on this machine or a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from pilotage.experiments.studies.trial import Outcome, Task

AHEAD = 2
"""Tasks that a worker holds: the one it runs and the next."""
WAIT_S = 1.0
"""How long at most one look at the outcomes waits."""


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
        """What has ended since the last call, what hung included; waits a moment where nothing has."""
        ...

    def stop(self) -> None:
        """Stop at once; what runs is lost."""
        ...


def hung(row: int, limit_s: float) -> Outcome:
    """The outcome of a trial that was stopped after its time."""
    return Outcome(row, {}, {}, f"stopped: it ran for more than {limit_s:g} s (--trial-timeout)")
