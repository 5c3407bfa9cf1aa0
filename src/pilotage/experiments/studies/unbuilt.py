"""A study of which nothing can be built is refused like a mission of which that is so."""

from __future__ import annotations

from collections.abc import Callable

from pilotage.core.errors import InputError
from pilotage.experiments.studies.study import Study
from pilotage.experiments.studies.trial import Outcome

SURE = 3
"""So many seeds of a cell that cannot be built tell of all; one of them may only have drawn a bad place."""


class NothingBuiltError(InputError):
    """Of no cell of a study anything can be built."""


class Unbuilt:
    """Holds back what is told of trials that cannot be built, until one of the study could be.

    Parameters
    ----------
    fresh
        Whether the study has just been begun, by this process alone.
    tell
        Told of each such trial, once it is clear that not all are so.

    Attributes
    ----------
    asks
        Whether it is open still.
    """

    def __init__(self, study: Study, tell: Callable[[str], None], *, fresh: bool) -> None:
        self._study, self._tell = study, tell
        self._open = {number: min(SURE, study.definition.trials) for number in range(len(study.cells))}
        self._held: list[str] = []
        self._first: tuple[int, str] | None = None
        self.asks = fresh

    def hear(self, cell: int, outcome: Outcome, told: str) -> None:
        """Take in what came of a trial; ``told`` is the line to be said of it, empty where it went well.

        Raises
        ------
        NothingBuiltError
            With the first reason, once no cell is left of which anything could be built.
        """
        if not self.asks:
            if told:
                self._tell(told)
            return
        if not outcome.reason or outcome.retry:
            self.let_go()
            if told:
                self._tell(told)
            return
        self._held.append(told)
        self._first = min(self._first or (cell, outcome.reason), (cell, outcome.reason))
        left = self._open.get(cell, 0) - 1
        self._open[cell] = left
        if left <= 0:
            self._open.pop(cell)
        if not self._open:
            number, reason = self._first
            name = self._study.cells[number].name
            of = f"cell '{name}' (and no other can be built): " if len(self._study.cells) > 1 else ""
            raise NothingBuiltError(f"study '{self._study.name}': {of}{reason}")

    def let_go(self) -> None:
        """Say what was held back."""
        self.asks = False
        for told in self._held:
            self._tell(told)
        self._held = []
