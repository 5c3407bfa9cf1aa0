"""Judging a study: every cell's summary, and every cell against the baseline on the same seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.intervals import Summary, summarize, wilson
from pilotage.evaluation.paired import Difference, corrected, difference

SUCCESS = "success"


@dataclass(frozen=True, slots=True)
class Rate:
    """A success rate with its 95 % Wilson interval."""

    successes: int
    trials: int
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a study says.

    Attributes
    ----------
    summaries
        By metric, one summary a cell.
    rates
        One success rate a cell.
    differences
        By metric, one a cell against the baseline; None for the baseline itself, and all of them where
        there is no baseline. Their ``p_corrected`` counts all comparisons of all metrics here.
    """

    summaries: Mapping[str, Sequence[Summary]]
    rates: Sequence[Rate]
    differences: Mapping[str, Sequence[Difference | None]]


def judge(
    cell: IntArray, trial: IntArray, values: Mapping[str, FloatArray], cells: int, baseline: int | None
) -> Judgement:
    """Judge the finished trials of a study.

    Parameters
    ----------
    cell, trial
        (n,) which cell a row belongs to, and its number there; rows with the same number share a seed.
    values
        By metric, (n,) its values; nan where a trial does not give it. ``success`` is 0 or 1.
    cells
        How many cells there are, those without a finished trial included.
    baseline
        The cell that the others are held against.
    """
    summaries = {
        metric: [summarize(column[cell == index]) for index in range(cells)]
        for metric, column in values.items()
    }
    rates = [
        _rate(values[SUCCESS][cell == i]) if SUCCESS in values else _rate(np.zeros(0)) for i in range(cells)
    ]
    if baseline is None:
        nothing: list[Difference | None] = [None] * cells
        return Judgement(summaries, rates, dict.fromkeys(values, nothing))
    found = {
        metric: [
            None if index == baseline else _paired(cell, trial, column, baseline, index, metric == SUCCESS)
            for index in range(cells)
        ]
        for metric, column in values.items()
    }
    return Judgement(summaries, rates, _correct(found))


def paired_columns(
    cell: IntArray, trial: IntArray, column: FloatArray, first: int, other: int
) -> tuple[FloatArray, FloatArray]:
    """(k,) and (k,) the values of two cells in the trials that both have, in the order of the trials."""
    left = dict(zip(trial[cell == first].tolist(), column[cell == first].tolist(), strict=True))
    right = dict(zip(trial[cell == other].tolist(), column[cell == other].tolist(), strict=True))
    common = sorted(left.keys() & right.keys())
    return np.array([left[t] for t in common]), np.array([right[t] for t in common])


def _paired(
    cell: IntArray, trial: IntArray, column: FloatArray, first: int, other: int, binary: bool
) -> Difference:
    return difference(*paired_columns(cell, trial, column, first, other), binary=binary)


def _correct(found: dict[str, list[Difference | None]]) -> dict[str, list[Difference | None]]:
    """Correct all p-values at once."""
    places = [
        (metric, i) for metric, row in found.items() for i, entry in enumerate(row) if entry is not None
    ]
    p_values = [entry.p_value for row in found.values() for entry in row if entry is not None]
    out = {metric: list(row) for metric, row in found.items()}
    for (metric, index), p_value in zip(places, corrected(p_values), strict=True):
        entry = out[metric][index]
        assert entry is not None
        out[metric][index] = replace(entry, p_corrected=p_value)
    return out


def _rate(success: FloatArray) -> Rate:
    finite = success[np.isfinite(success)]
    good = int(finite.sum())
    return Rate(good, int(finite.size), *wilson(good, int(finite.size)))
