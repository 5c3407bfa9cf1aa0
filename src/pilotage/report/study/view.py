"""A study as its page sees it: cells, rows, and what was published about them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Cell:
    """One setting: its short name, the factors' values, and what others published for it by metric."""

    index: int
    name: str
    values: Mapping[str, object]
    published: Mapping[str, float]


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
    baseline: int | None
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

    def column(self, metric: str) -> FloatArray:
        """(n,) a metric's values; nan where the study has none of it."""
        found = self.values.get(metric)
        return np.full(self.cell.shape, math.nan) if found is None else found

    def short(self, factor: str) -> str:
        """A factor's name as it is said: the last part of its key, units apart."""
        return factor.rsplit(".", 1)[-1].replace("_", " ")
