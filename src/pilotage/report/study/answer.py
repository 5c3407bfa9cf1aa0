"""The answer in one sentence, with its interval."""

from __future__ import annotations

import math

from pilotage.evaluation.intervals import Summary
from pilotage.evaluation.judge import Judgement
from pilotage.report import quantities
from pilotage.report.metrics_table import Metric, metric_of
from pilotage.report.study.view import StudyView

SURE = 0.05


def best_cell(judgement: Judgement, metric: str, lower: bool) -> int | None:
    """The cell with the best mean; None where no cell has one."""
    means = [summary.mean for summary in judgement.summaries.get(metric, ())]
    known = [(mean, index) for index, mean in enumerate(means) if math.isfinite(mean)]
    if not known:
        return None
    return (min(known) if lower else max(known, key=lambda entry: (entry[0], -entry[1])))[1]


def interval(metric: Metric, summary: Summary) -> str:
    """Mean and interval in the metric's own words."""
    if not math.isfinite(summary.mean):
        return quantities.NOTHING
    if not math.isfinite(summary.low):
        return metric.write(summary.mean)
    return f"{metric.write(summary.mean)} ({metric.write(summary.low)} to {metric.write(summary.high)})"


def answer(view: StudyView, judgement: Judgement) -> str:
    """One sentence: which setting is best, by how much against the baseline, and how surely."""
    metric = metric_of(view.primary)
    best = best_cell(judgement, view.primary, view.lower_is_better)
    if best is None:
        return f"No trial gave {metric.name}."
    summary = judgement.summaries[view.primary][best]
    found = interval(metric, summary)
    if len(view.cells) == 1:
        return f"{_sentence(metric.name)} is {found} over {summary.n} trials (mean with its 95 % interval)."
    lead = "lowest" if view.lower_is_better else "highest"
    text = f"{_sentence(metric.name)} is {lead} with {view.cells[best].name}: {found}"
    change = None if view.baseline is None else judgement.differences[view.primary][best]
    if change is None or change.n == 0:
        return f"{text}, mean with its 95 % interval over {summary.n} trials."
    assert view.baseline is not None
    evidence = (
        f"p = {change.p_corrected:.2g} after correction"
        if math.isfinite(change.p_corrected) and change.p_corrected < SURE
        else "which these trials do not tell from chance"
    )
    return (
        f"{text}; against {view.cells[view.baseline].name} it changes by {metric.write(change.mean)} "
        f"({metric.write(change.low)} to {metric.write(change.high)}) on the same {change.n} seeds, "
        f"{evidence}."
    )


def _sentence(text: str) -> str:
    return text if text[:2].isupper() else text[:1].upper() + text[1:]
