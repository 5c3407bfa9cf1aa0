"""What a study found: the effect of each factor on what matters, the best settings, and what stays open."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.evaluation.effects import SURE, Effect, against_picked, effects_of_each, holm
from pilotage.evaluation.intervals import Summary
from pilotage.evaluation.judge import SUCCESS, Judgement
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.paired import difference, difference_apart, least_trials
from pilotage.experiments.studies.definition import CONFIGURATION
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable

SETTING = "setting"
"""What the cells of a group are called together, where no factors span them."""
PARTS = 2
"""Families of tests that share the chance of a false finding: the primary metric's, and all others'."""
MOST_FACTORS = 6
"""Of more factors at once none is looked at alone."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One effect on one metric.

    Attributes
    ----------
    group
        Name of the group of cells, empty where there is but one.
    factors
        One for a main effect, two for an interaction.
    levels
        By factor, the levels that were compared.
    without
        Factors with a level that was left out, for no trial at it gives the metric.
    p_corrected
        Corrected for all findings of the study (Holm): at most one study in twenty without any effect has one
        below 0.05.
    """

    metric: str
    group: str
    factors: tuple[str, ...]
    levels: tuple[tuple[Any, ...], ...]
    effect: Effect
    p_corrected: float
    without: tuple[tuple[str, Any], ...] = ()

    @property
    def is_sure(self) -> bool:
        """Whether chance does not explain it."""
        return math.isfinite(self.p_corrected) and self.p_corrected < SURE


@dataclass(frozen=True, slots=True)
class Best:
    """The best setting of a group by one metric, and those that these trials do not tell from it.

    ``needed`` trials of each setting are the fewest with which any two could be told apart, however much they
    differ; 0 where there are as many.
    """

    metric: str
    group: str
    cell: int
    summary: Summary
    also: tuple[int, ...]
    needed: int


@dataclass(frozen=True, slots=True)
class _Design:
    """Cells of a group as a complete design: by factor its levels; ``cells`` (l1, ..., lk)."""

    group: CellGroup
    factors: tuple[str, ...]
    levels: tuple[tuple[Any, ...], ...]
    cells: IntArray

    without: tuple[tuple[str, Any], ...] = ()
    """Factors with a level that was left out."""

    @property
    def ordered(self) -> list[bool]:
        return [all(_is_number(level) for level in levels) for levels in self.levels]

    def given(self, there: BoolArray) -> _Design:
        """The same without levels of which no cell is there; what keeps one level is no factor."""
        found, axes = there[self.cells], range(self.cells.ndim)
        kept = [np.any(np.moveaxis(found, axis, 0).reshape(found.shape[axis], -1), axis=1) for axis in axes]
        varied = [axis for axis in axes if kept[axis].sum() > 1]
        alone = tuple(axis for axis in axes if axis not in varied)
        gone = [
            (factor, level)
            for factor, levels, keep in zip(self.factors, self.levels, kept, strict=True)
            for level, has in zip(levels, keep, strict=True)
            if not has
        ]
        return _Design(
            self.group,
            tuple(self.factors[axis] for axis in varied),
            tuple(tuple(itertools.compress(self.levels[axis], kept[axis])) for axis in varied),
            self.cells[np.ix_(*kept)].squeeze(alone),
            tuple(gone),
        )


def findings_of(table: StudyTable) -> list[Finding]:
    """Effects of the factors on every metric that matters, the metric that answers the question first.

    Half of the chance of a false finding is left to that one metric, the other half to all others together
    (Holm's correction within each half): asking for more metrics does not hide its answer.
    """
    designs = [design for group in table.groups if (design := _design(table, group)) is not None]
    others = [metric for metric in dict.fromkeys([*table.telling, SUCCESS]) if metric != table.primary]
    out: list[Finding] = []
    for family in ([table.primary], others):
        by_design = [_effects(table, family, design) for design in designs]
        found = [
            (metric, given, effect)
            for metric in family
            for each in by_design
            for given, effect in each.get(metric, ())
        ]
        # What never varies is no test and takes nothing from the others.
        tests = PARTS * sum(math.isfinite(effect.p_value) for _, _, effect in found)
        found = [(metric, design, effect.among(tests)) for metric, design, effect in found]
        p_values = holm([effect.p_value for _, _, effect in found], PARTS)
        out += [
            Finding(
                metric,
                design.group.name,
                tuple(design.factors[axis] for axis in effect.axes),
                tuple(design.levels[axis] for axis in effect.axes),
                effect,
                p,
                design.without,
            )
            for (metric, design, effect), p in zip(found, p_values, strict=True)
        ]
    return out


def _effects(
    table: StudyTable, metrics: Sequence[str], design: _Design
) -> dict[str, list[tuple[_Design, Effect]]]:
    """The effects on each metric over the trials that give it at every setting that gives it at all."""
    alike: dict[tuple[object, ...], tuple[_Design, dict[str, FloatArray]]] = {}
    for metric in metrics:
        values = by_trial(table, metric)
        there: BoolArray = np.any(np.isfinite(values), axis=0)
        if not there[design.cells].any():
            continue
        given = design.given(there)
        if not given.factors:  # one setting alone gives it
            continue
        trials = values[:, given.cells]
        complete = trials[np.isfinite(trials).reshape(trials.shape[0], -1).all(axis=1)]
        alike.setdefault((given.without, len(complete)), (given, {}))[1][metric] = complete
    out: dict[str, list[tuple[_Design, Effect]]] = {}
    for given, each in alike.values():
        found = effects_of_each([*each.values()], ordered=given.ordered, paired=table.same_seeds)
        for metric, effects in zip(each, found, strict=True):
            out[metric] = [(given, effect) for effect in effects]
    return out


def best_settings(table: StudyTable, judgement: Judgement) -> list[Best]:
    """By group and metric, the setting with the best mean, or the one nearest to the metric's ideal.

    Metrics that do not differ, or of which nothing is known to be better, are left out.
    """
    out = []
    for metric in dict.fromkeys([table.primary, *table.telling]):
        lower, ideal = table.less_is_better(metric), METRICS.find(metric).ideal
        means = np.array([summary.mean for summary in judgement.summaries[metric]])
        values = by_trial(table, metric)
        if lower is None:
            means, values = np.abs(means - ideal), np.abs(values - ideal)
        elif not lower:
            means, values = -means, -values
        for group in table.groups:
            known = [index for index in group.cells if math.isfinite(means[index])]
            if len(known) < 2 or np.ptp(means[known]) == 0.0:
                continue
            best = min(known, key=lambda index: float(means[index]))
            others = [index for index in known if index != best]
            compare = difference if table.same_seeds else difference_apart
            found = [compare(values[:, best], values[:, index]) for index in others]
            # A mean may be better for the sake of a few trials while ranks say the contrary.
            p_values = against_picked([one.p_value if one.effect > 0.0 else math.nan for one in found])
            also = (i for i, p in zip(others, p_values, strict=True) if not (math.isfinite(p) and p < SURE))
            needed = least_trials(math.comb(len(known), 2), SURE, paired=table.same_seeds)
            enough = max(one.n for one in found) >= needed
            summary = judgement.summaries[metric][best]
            out.append(Best(metric, group.name, best, summary, tuple(also), 0 if enough else needed))
    return out


def by_trial(table: StudyTable, metric: str) -> FloatArray:
    """(trials, cells) a metric's values; nan where there is none, or none that compares."""
    out = np.full((table.study.definition.trials, len(table.study.cells)), math.nan)
    out[table.trial, table.cell] = table.comparable(metric)
    return out


def study_object(table: StudyTable) -> dict[str, Any]:
    """The study's JSON object: what it found, counts, and one object a cell."""
    judgement = table.judged()
    cells = []
    for cell in table.study.cells:
        rate = judgement.rates[cell.index]
        metrics = {}
        for name in table.metrics:
            found = judgement.summaries[name][cell.index]
            metrics[name] = {
                "n": found.n,
                "mean": found.mean,
                "median": found.median,
                "low": found.low,
                "high": found.high,
                "variance": found.variance,
            }
        cells.append(
            {
                "name": cell.name,
                "values": dict(cell.values),
                "success": {
                    "n": rate.trials,
                    "mean": rate.successes / rate.trials if rate.trials else None,
                    "low": rate.low,
                    "high": rate.high,
                },
                "metrics": metrics,
                **({"published": dict(cell.published)} if cell.published else {}),
            }
        )
    return {
        **_found(table, judgement),
        "study": table.study.name,
        "mission": table.study.base.get("mission", table.study.definition.mission),
        "trials": len(table.row) + len(table.broken),
        "failed": len(table.broken),
        "missing": table.waiting,
        "primary": table.primary,
        "cells": cells,
        "study_dir": str(table.folder),
    }


def _found(table: StudyTable, judgement: Judgement) -> dict[str, Any]:
    """Findings and best settings as plain values."""
    names = [cell.name for cell in table.study.cells]
    return {
        "findings": [_plain(finding) for finding in findings_of(table)],
        "best": [
            {
                "metric": best.metric,
                **({"group": best.group} if best.group else {}),
                "setting": names[best.cell],
                "mean": best.summary.mean,
                "low": best.summary.low,
                "high": best.summary.high,
                "not_told_from_it": [names[index] for index in best.also],
                **({"trials_needed": best.needed} if best.needed else {}),
            }
            for best in best_settings(table, judgement)
        ],
    }


def _plain(finding: Finding) -> dict[str, Any]:
    effect, change = finding.effect, finding.effect.change()
    needed = math.nan if finding.is_sure else effect.needed()
    return {
        "metric": finding.metric,
        "unit": METRICS.find(finding.metric).unit,
        **({"group": finding.group} if finding.group else {}),
        "factors": list(finding.factors),
        **({"without": [list(pair) for pair in finding.without]} if finding.without else {}),
        "levels": [list(levels) for levels in finding.levels],
        "means": effect.means.tolist(),
        "trials": effect.n,
        "from": finding.levels[-1][effect.ends[0]],
        "to": finding.levels[-1][effect.ends[1]],
        "change": change.mean,
        "low": change.low,
        "high": change.high,
        "share_of_variance": effect.share,
        "p": effect.p_value,
        "p_corrected": finding.p_corrected,
        "sure": finding.is_sure,
        "detectable_change": effect.detectable(),
        "trials_needed": needed,
    }


def _design(table: StudyTable, group: CellGroup) -> _Design | None:
    """The factors that span a group's cells; all cells as levels of one where none do; None for one cell."""
    if len(group.cells) < 2:
        return None
    cells = [table.study.cells[index] for index in group.cells]
    named = [
        factor
        for factor in table.study.definition.factor_names
        if all(factor in cell.values for cell in cells)
        and len({repr(cell.values[factor]) for cell in cells}) > 1
    ]
    for factors in _candidates(named):
        levels = tuple(_levels([cell.values[factor] for cell in cells]) for factor in factors)
        if math.prod(map(len, levels)) != len(cells):
            continue
        places = [
            tuple(known.index(cell.values[factor]) for known, factor in zip(levels, factors, strict=True))
            for cell in cells
        ]
        if len(set(places)) == len(cells):
            index = np.zeros(tuple(map(len, levels)), dtype=np.int64)
            for place, cell in zip(places, cells, strict=True):
                index[place] = cell.index
            return _Design(group, tuple(factors), levels, index)
    everything = tuple(cell.name for cell in cells)
    return _Design(group, (SETTING,), (everything,), np.array(group.cells, dtype=np.int64))


def _candidates(named: Sequence[str]) -> Iterator[list[str]]:
    """Sets of factors that may span the cells: what configurations amount to, rather than their names."""
    alone = [factor for factor in named if factor != CONFIGURATION]
    for factors in (alone, list(named)):
        if 0 < len(factors) <= MOST_FACTORS:
            yield factors


def _levels(values: Sequence[Any]) -> tuple[Any, ...]:
    """Each value once, numbers in their order, others as they come."""
    once: list[Any] = []
    for value in values:
        if value not in once:
            once.append(value)
    return tuple(sorted(once)) if all(_is_number(value) for value in once) else tuple(once)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
