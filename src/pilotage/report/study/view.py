"""A study as its page sees it: cells, rows, and what was published about them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.report.study.scales import key_and_unit


@dataclass(frozen=True, slots=True)
class Cell:
    """One setting: its unique name, the factors' values, what others published for it by metric.

    ``label`` is how it is called among the cells of its group, with units; the name where there is none.
    """

    index: int
    name: str
    values: Mapping[str, object]
    published: Mapping[str, float]
    label: str = ""

    @property
    def text(self) -> str:
        """How it is called on the page."""
        return self.label or self.name


@dataclass(frozen=True, slots=True)
class Group:
    """Cells that are judged together, and by cell the one that it is held against (None: nothing)."""

    name: str
    cells: tuple[int, ...]
    baselines: tuple[int | None, ...]

    @property
    def baseline(self) -> int | None:
        """The one cell of the group that all others of it are held against; None where there is none such."""
        found = {base for base in self.baselines if base is not None}
        if len(found) != 1:
            return None
        (only,) = found
        return only if only in self.cells and self.baselines.count(only) == len(self.cells) - 1 else None


@dataclass(frozen=True, slots=True)
class Failure:
    """A trial that gave no numbers."""

    row: int
    cell: int
    seed: int
    reason: str


@dataclass(frozen=True, slots=True)
class StudyView:
    """Everything that the page needs.

    Attributes
    ----------
    primary
        The metric that answers the question, and ``lower_is_better``.
    note
        What else a reader must know, such as where the published values come from.
    groups
        Every cell in one of them.
    contrasts
        Pairs of metrics that are held against each other within every trial.
    units
        By factor, the unit of its values.
    asked
        Whether somebody chose the metrics; of all that the trials give, those that never vary are left out.
    same_seeds
        Whether the settings took the same seeds, so that trials are pairs.
    reference
        By metric, a value that bounds it or that it is held against, such as a known optimum, with its name.
    row, cell, trial, seed
        (n,) of the finished trials.
    values
        By metric, (n,); nan where a trial does not give it.
    """

    name: str
    question: str
    mission: str
    cells: tuple[Cell, ...]
    factors: tuple[str, ...]
    metrics: tuple[str, ...]
    primary: str
    lower_is_better: bool
    groups: tuple[Group, ...]
    reference: Mapping[str, tuple[str, float]]
    trials_per_cell: int
    first_seed: int
    row: IntArray
    cell: IntArray
    trial: IntArray
    seed: IntArray
    values: Mapping[str, FloatArray]
    failures: tuple[Failure, ...]
    waiting: int
    definition: str
    note: str = ""
    contrasts: tuple[tuple[str, str], ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    asked: bool = True
    same_seeds: bool = True
    versions: str = ""

    def column(self, metric: str) -> FloatArray:
        """(n,) a metric's values; nan where the study has none of it."""
        found = self.values.get(metric)
        return np.full(self.cell.shape, math.nan) if found is None else found

    def short(self, factor: str) -> str:
        """A factor's name as it is said: the last part of its key, its unit apart."""
        return key_and_unit(factor)[0]

    def unit(self, factor: str) -> str:
        """The unit of a factor's values; empty where it has none."""
        return self.units.get(factor, key_and_unit(factor)[1])

    @property
    def baselines(self) -> list[int | None]:
        """One a cell: what it is held against."""
        out: list[int | None] = [None] * len(self.cells)
        for group in self.groups:
            for index, base in zip(group.cells, group.baselines, strict=True):
                out[index] = base
        return out

    def known_as(self, index: int, group: Group) -> str:
        """What a cell is called beside the cells of a group: its own name where it is none of them."""
        return self.cells[index].text if index in group.cells else self.cells[index].name

    def worth_showing(self, metric: str, cells: Iterable[Cell]) -> bool:
        """Whether the trials of some cells give a metric, and it varies or was asked for."""
        inside = np.isin(self.cell, [cell.index for cell in cells])
        found = self.column(metric)[inside]
        found = found[np.isfinite(found)]
        if not found.size:
            return False
        return self.asked or metric == self.primary or found.size == 1 or bool(np.ptp(found) > 0.0)

    def members(self, group: Group) -> list[Cell]:
        """The cells of a group."""
        return [self.cells[index] for index in group.cells]
