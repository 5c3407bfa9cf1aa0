"""Judging a study: every cell's summary, and every cell against its baseline, on the same seeds or apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.intervals import Summary, summarize, wilson
from pilotage.evaluation.paired import Difference, corrected, difference, difference_apart

SUCCESS = "success"
Pair = tuple[str, str]


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
        By metric, one a cell against its baseline; None for a baseline itself and where there is none.
    contrasts
        By (metric, other metric), one a cell: the first less the second in the same trials.

    ``p_corrected`` counts all comparisons made here: of all metrics, cells and contrasts.
    """

    summaries: Mapping[str, Sequence[Summary]]
    rates: Sequence[Rate]
    differences: Mapping[str, Sequence[Difference | None]]
    contrasts: Mapping[Pair, Sequence[Difference]]


def judge(
    cell: IntArray,
    trial: IntArray,
    values: Mapping[str, FloatArray],
    baselines: Sequence[int | None],
    contrasts: Sequence[Pair] = (),
    *,
    same_seeds: bool = True,
) -> Judgement:
    """Judge the finished trials of a study.

    Parameters
    ----------
    cell, trial
        (n,) which cell a row belongs to, and its number there.
    values
        By metric, (n,) its values; nan where a trial does not give it. ``success`` is 0 or 1.
    baselines
        One a cell, those without a finished trial included: the cell that it is held against, or None.
    contrasts
        Pairs of metrics that are held against each other within every trial.
    same_seeds
        Whether rows with the same number share a seed: cells are then compared pair by pair.
    """
    cells = len(baselines)
    summaries = {
        metric: [summarize(column[cell == index]) for index in range(cells)]
        for metric, column in values.items()
    }
    rates = [
        _rate(values[SUCCESS][cell == i]) if SUCCESS in values else _rate(np.zeros(0)) for i in range(cells)
    ]
    across = {
        (metric, index): _paired(cell, trial, column, base, index, metric == SUCCESS)
        if same_seeds
        else difference_apart(column[cell == base], column[cell == index], binary=metric == SUCCESS)
        for metric, column in values.items()
        for index, base in enumerate(baselines)
        if base is not None and base != index
    }
    empty = np.full(cell.shape, np.nan)
    within = {
        ((first, other), index): difference(
            values.get(other, empty)[cell == index], values.get(first, empty)[cell == index]
        )
        for first, other in contrasts
        for index in range(cells)
    }
    across, within = _correct(across, within)
    return Judgement(
        summaries,
        rates,
        {metric: [across.get((metric, index)) for index in range(cells)] for metric in values},
        {pair: [within[pair, index] for index in range(cells)] for pair in contrasts},
    )


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


def _correct(
    across: Mapping[tuple[str, int], Difference], within: Mapping[tuple[Pair, int], Difference]
) -> tuple[dict[tuple[str, int], Difference], dict[tuple[Pair, int], Difference]]:
    """Correct all p-values at once."""
    p_values = corrected([entry.p_value for entry in (*across.values(), *within.values())])
    one, other = p_values[: len(across)], p_values[len(across) :]
    return (
        {key: replace(across[key], p_corrected=p) for key, p in zip(across, one, strict=True)},
        {key: replace(within[key], p_corrected=p) for key, p in zip(within, other, strict=True)},
    )


def _rate(success: FloatArray) -> Rate:
    finite = success[np.isfinite(success)]
    good = int(finite.sum())
    return Rate(good, int(finite.size), *wilson(good, int(finite.size)))
