"""What a group of settings says besides its answer: success, consistency, contrasts, the published."""

from __future__ import annotations

import math
from collections import Counter

from pilotage.evaluation.judge import Judgement, Rate
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.pooled import FEWEST_RUNS, IDEALS, pool
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.study.scales import p_value, points, told

FEW = 3
"""So many settings are named one by one; of more, their number."""


def facts(table: StudyTable, judgement: Judgement, group: CellGroup) -> list[str]:
    """Sentences about a group, each only where the study can tell."""
    found = [
        _success(table, judgement, group),
        *_contrasts(table, judgement, group),
        _consistency(table, group),
        _published(table, judgement, group),
    ]
    return [text for text in found if text]


def _success(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    rated = [(cell, judgement.rates[cell.index]) for cell in table.members(group)]
    rated = [(cell, rate) for cell, rate in rated if rate.trials]
    if not rated:
        return ""
    if len(rated) <= FEW:
        return f"Success: {'; '.join(f'{cell.text}: {rate_text(rate)}' for cell, rate in rated)}."
    good, all_of_them = sum(rate.successes for _, rate in rated), sum(rate.trials for _, rate in rated)
    if good in (0, all_of_them):
        return f"Success: {'all' if good else 'none'} of the {all_of_them} trials."
    cell, rate = min(rated, key=lambda entry: entry[1].successes / entry[1].trials)
    return f"Success: {good} of {all_of_them} trials, fewest with {cell.text}, {rate_text(rate)}."


def rate_text(rate: Rate) -> str:
    """A success rate in numbers, with its Wilson interval."""
    return f"{rate.successes} of {rate.trials} ({100.0 * rate.low:.0f} to {100.0 * rate.high:.0f}\u00a0%)"


def _contrasts(table: StudyTable, judgement: Judgement, group: CellGroup) -> list[str]:
    out = []
    for (first, other), found in judgement.contrasts.items():
        parts = []
        for cell in table.members(group):
            change = found[cell.index]
            if not change.n:
                continue
            sure = math.isfinite(change.p_corrected) and change.p_corrected < 0.05
            how = p_value(change.p_corrected, "p ") if sure else "not told from chance"
            means = [
                told(name, judgement.summaries[name][cell.index].mean, math.nan, math.nan)
                for name in (first, other)
            ]
            by = points(told(first, change.mean, change.low, change.high, signed=True))
            parts.append(f"{cell.text}: {means[0]} against {means[1]}, {by}, {how}, {change.n} trials")
        if parts:
            out.append(
                f"{METRICS.find(first).name} against {METRICS.find(other).name}, in the same trials: "
                f"{'; '.join(parts)}."
            )
    return [text[:1].upper() + text[1:] for text in out]


def _consistency(table: StudyTable, group: CellGroup) -> str:
    parts = []
    for metric in IDEALS:
        if metric not in table.metrics:
            continue
        verdicts = {
            cell.text: pool(table.column(metric)[table.cell == cell.index], IDEALS[metric])
            for cell in table.members(group)
        }
        known = {name: entry.verdict for name, entry in verdicts.items() if entry.n >= FEWEST_RUNS}
        if not known:
            continue
        if len(known) <= FEW:
            text = ", ".join(f"{name}: {verdict}" for name, verdict in known.items())
        else:
            text = ", ".join(
                f"{number} {verdict}" for verdict, number in Counter(known.values()).most_common()
            )
        parts.append(f"by {METRICS.find(metric).name}, {text}")
    return f"Consistency of the settings: {'; '.join(parts)}." if parts else ""


def _published(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    metric = table.primary
    cells: list[Cell] = [cell for cell in table.members(group) if metric in cell.published]
    known = [(cell.published[metric], judgement.summaries[metric][cell.index]) for cell in cells]
    known = [(value, summary) for value, summary in known if math.isfinite(summary.mean)]
    if not known:
        return ""
    below = sum((summary.high if math.isfinite(summary.high) else summary.mean) < v for v, summary in known)
    above = sum((summary.low if math.isfinite(summary.low) else summary.mean) > v for v, summary in known)
    inside = len(known) - below - above
    return (
        f"Against the published {METRICS.find(metric).name}, our interval lies below it at {below} of "
        f"{len(known)} settings, above it at {above}, and holds it at {inside}."
    )
