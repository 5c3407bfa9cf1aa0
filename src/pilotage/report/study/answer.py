"""The answer in one sentence, with its interval, and what else each group of settings says."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from pilotage.evaluation.intervals import Summary
from pilotage.evaluation.judge import Judgement
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.paired import Difference
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.study.findings import FEW, facts, rate_text
from pilotage.report.study.scales import p_value, points, told

SURE = 0.05


def best_cell(judgement: Judgement, metric: str, lower: bool, cells: Iterable[int]) -> int | None:
    """The one of some cells with the best mean; None where none of them has one."""
    known = [(judgement.summaries[metric][index].mean, index) for index in cells]
    known = [entry for entry in known if math.isfinite(entry[0])]
    if not known:
        return None
    return (min(known) if lower else max(known, key=lambda entry: (entry[0], -entry[1])))[1]


def answer(table: StudyTable, judgement: Judgement) -> str:
    """One sentence: what the settings of each group give, with intervals."""
    metric = METRICS.find(table.primary)
    if not any(math.isfinite(summary.mean) for summary in judgement.summaries[table.primary]):
        return f"No trial gave {metric.name}."
    if _is_few_alone(table):
        return f"{'; '.join(_each(table, judgement, cell) for cell in table.cells)}."
    if len(table.groups) == 1:
        return f"{_sentence(metric.name)} {_group(table, judgement, table.groups[0])}."
    parts = [
        f"{group.name}: {_in_short(table, judgement, group)}"
        for group in table.groups
        if best_cell(judgement, table.primary, table.lower_is_better, group.cells) is not None
    ]
    return f"{_sentence(metric.name)}, mean with its 95 % interval. {_sentence('; '.join(parts))}."


def answers(table: StudyTable, judgement: Judgement) -> list[tuple[str, list[str]]]:
    """What each group of settings says: its name, and sentences."""
    metric, several = METRICS.find(table.primary), len(table.groups) > 1
    out = []
    for group in table.groups:
        found = best_cell(judgement, table.primary, table.lower_is_better, group.cells)
        own = (
            [f"{_sentence(metric.name)} {_group(table, judgement, group)}."]
            if several and found is not None
            else []
        )
        out.append((group.name, [*own, *facts(table, judgement, group)]))
    return [entry for entry in out if entry[1]]


def evidence(change: Difference) -> str:
    """How surely a difference is one."""
    if not math.isfinite(change.p_value):
        return "no trial differs" if change.n > 1 else "one pair tells nothing"
    if change.p_corrected < SURE:
        return f"{p_value(change.p_corrected, 'p ')} after correction"
    return "not told from chance"


def _is_few_alone(table: StudyTable) -> bool:
    """Whether the study is a few settings by name, held against nothing."""
    names_alone = all(isinstance(value, str) for cell in table.cells for value in cell.values.values())
    alone = all(base is None for group in table.groups for base in group.baselines)
    return names_alone and alone and len(table.groups) == 1 and 1 < len(table.cells) <= FEW


def _each(table: StudyTable, judgement: Judgement, cell: Cell) -> str:
    """One of a few settings that are held against nothing: how often it succeeds, and its metric."""
    rate = judgement.rates[cell.index]
    summary = judgement.summaries[table.primary][cell.index]
    succeeds = f"success {rate_text(rate)}, " if rate.trials else ""
    name = METRICS.find(table.primary).name
    return f"{cell.text}: {succeeds}{name} {_interval(table.primary, summary)} in the mean"


def _in_short(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    """The baseline, the best and the worst of a group."""
    summaries = judgement.summaries[table.primary]
    best = best_cell(judgement, table.primary, table.lower_is_better, group.cells)
    worst = best_cell(judgement, table.primary, not table.lower_is_better, group.cells)
    assert best is not None
    assert worst is not None
    base = group.baseline if group.baseline is not None else best
    if len(group.cells) == 1:
        return _interval(table.primary, summaries[best])
    if summaries[best].mean == summaries[worst].mean:
        return f"{_interval(table.primary, summaries[base])} at every setting"
    low, high = (best, worst) if table.lower_is_better else (worst, best)
    parts = (
        [f"{_interval(table.primary, summaries[base])} with {table.cells[base].text}"] if base != best else []
    )
    parts += [
        f"{word} {_interval(table.primary, summaries[index])} with {table.cells[index].text}"
        for word, index in (("least", low), ("most", high))
        if index != base or base == best
    ]
    return ", ".join(parts)


def _group(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    """A group's settings: where the metric is lowest and highest, and against what."""
    summaries = judgement.summaries[table.primary]
    lower = table.lower_is_better
    best = best_cell(judgement, table.primary, lower, group.cells)
    worst = best_cell(judgement, table.primary, not lower, group.cells)
    assert best is not None
    assert worst is not None
    over = _over([summaries[index].n for index in group.cells])
    if len(group.cells) == 1 and group.baselines[0] is None:
        return f"is {_interval(table.primary, summaries[best])}, mean with its 95 % interval {over}"
    base = group.baseline
    if base is None and any(entry is not None for entry in group.baselines):
        return _each_against_its_own(table, judgement, group)
    first, last = ("lowest", "highest") if lower else ("highest", "lowest")
    if base is None:
        if sum(math.isfinite(summaries[index].mean) for index in group.cells) == 1:
            only = _interval(table.primary, summaries[best])
            return f"is {only} with {table.cells[best].text}, the only setting that gave it, mean {over}"
        if all(summaries[index].mean == summaries[best].mean for index in group.cells):
            return f"is {_interval(table.primary, summaries[best])} at every setting, mean {over} each"
        return (
            f"is {first} with {table.cells[best].text}, {_interval(table.primary, summaries[best])}, and "
            f"{last} with {table.cells[worst].text}, {_interval(table.primary, summaries[worst])}: "
            f"{'means with their 95 % intervals ' if summaries[best].n > 1 else ''}{over} each"
        )
    start = f"is {_interval(table.primary, summaries[base])} with {table.cells[base].text}"
    found = [judgement.differences[table.primary][index] for index in group.cells if index != base]
    changes = [change for change in found if change is not None and change.n]
    if changes and all(change.low == change.high == 0.0 for change in changes):
        return f"{start}, and no other setting changes a single one of {changes[0].n} trials"
    parts = [
        _change(table, judgement, index, word)
        for index, word in ((best, first), (worst, last))
        if index != base
    ]
    none = f"no setting is {'lower' if lower else 'higher'}" if best == base else ""
    return "; ".join([start, *([none] if none else []), *parts])


def _over(counts: Sequence[int]) -> str:
    """Over how many trials means are taken; settings without any are left out."""
    few, many = min(count for count in counts if count), max(counts)
    return f"over {f'{few} to ' if few < many else ''}{many} trial{'s' if many > 1 else ''}"


def _change(table: StudyTable, judgement: Judgement, index: int, word: str) -> str:
    change = judgement.differences[table.primary][index]
    mean = judgement.summaries[table.primary][index].mean
    text = f"{word} with {table.cells[index].text}, {_plain(table, mean)}"
    if change is None or change.n == 0:
        return text
    by = difference(table.primary, change)
    seeds = (
        f"on the same {f'{change.n} seeds' if change.n > 1 else 'seed'}"
        if table.same_seeds
        else "on seeds of their own"
    )
    return f"{text}, a change by {by} {seeds}, {evidence(change)}"


def _each_against_its_own(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    parts = []
    for index, base in zip(group.cells, group.baselines, strict=True):
        change = judgement.differences[table.primary][index]
        if base is None or change is None or change.n == 0:
            continue
        found = judgement.summaries[table.primary][index]
        if change.low == change.high == 0.0:
            same = f"{_interval(table.primary, found)} with {table.cells[index].text}, in every trial"
            parts.append(f"{same} the same as with {table.known_as(base, group)}")
            continue
        parts.append(
            f"{_interval(table.primary, found)} with {table.cells[index].text}, a change by "
            f"{difference(table.primary, change)} against {table.known_as(base, group)}, {evidence(change)}"
        )
    return f"is {'; '.join(parts)}" if parts else "has no pairs to compare"


def difference(metric: str, change: Difference) -> str:
    """A difference with its interval; those of shares in percentage points."""
    return points(told(metric, change.mean, change.low, change.high, signed=True))


def _interval(metric: str, summary: Summary) -> str:
    return told(metric, summary.mean, summary.low, summary.high)


def _plain(table: StudyTable, value: float) -> str:
    return told(table.primary, value, math.nan, math.nan)


def _sentence(text: str) -> str:
    return text if text[:2].isupper() else text[:1].upper() + text[1:]
