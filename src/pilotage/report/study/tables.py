"""The study's tables: every setting with its intervals, its consistency, and the trials that broke."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from pilotage.evaluation.intervals import COVERAGE, Summary
from pilotage.evaluation.judge import Judgement, Rate
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.pooled import IDEALS, Pooled, pool
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report import markup, quantities
from pilotage.report.markup import PLAIN, ROW, VALUE, Html, Section, escape, section
from pilotage.report.study.answer import best_cell
from pilotage.report.study.scales import Scale, scale_of


def cells_table(table: StudyTable, judgement: Judgement) -> Section:
    """Mean and interval of each metric in each setting, beside what was published; all numbers folded."""
    parts = [_group_table(table, judgement, group) for group in table.groups]
    published = any(cell.published for cell in table.cells)
    return section(
        "cells",
        "Every setting",
        "<p>Means over the trials; below each its 95 % bootstrap interval, the variance in the square of the "
        f"column&#x27;s unit{', and what was published' if published else ''}. The best mean of a column is "
        f"bold. Success with its 95 % Wilson interval.{_of_few(table)}</p>",
        *parts,
    )


def _of_few(table: StudyTable) -> str:
    """What the intervals of a handful of trials are worth."""
    trials = table.study.definition.trials
    held = COVERAGE.get(trials)
    if held is None:
        return ""
    return (
        f" Of {trials} trials a bootstrap interval is too short: it holds the true mean in "
        f"about {100.0 * held:.0f} % of such studies."
    )


def _group_table(table: StudyTable, judgement: Judgement, group: CellGroup) -> str:
    given = [m for m in table.metrics if any(judgement.summaries[m][i].n for i in group.cells)]
    metrics = [m for m in given if table.worth_showing(m, table.members(group))]
    scales = {m: _scale(judgement, m, table.members(group)) for m in metrics}
    best = {
        m: best_cell(judgement, m, lower, group.cells)
        for m in metrics
        if (lower := _lower(table, judgement, m, group)) is not None and _differ(judgement, m, group)
    }
    rows = []
    for cell in table.members(group):
        entries = [
            _entry(
                judgement.summaries[m][cell.index],
                scales[m],
                best.get(m) == cell.index,
                cell.published.get(m),
            )
            for m in metrics
        ]
        rows.append([cell.text, _rate(judgement.rates[cell.index]), *entries])
    heads = [METRICS.find(m).name + scales[m].label for m in metrics]
    columns = [("setting", ROW), ("success", VALUE), *((head, PLAIN) for head in heads)]
    caption = f"<h3>{escape(group.name)}</h3>" if len(table.groups) > 1 else ""
    made = markup.table(columns, rows, "cells", box="wide")
    return f"{caption}{made}{_all_numbers(table, judgement, group, given)}"


def _entry(summary: Summary, scale: Scale, best: bool, published: float | None) -> Html:
    digits = scale.decimals(summary.mean, summary.low, summary.high)
    mean = scale.write(summary.mean, digits)
    lines = []
    if math.isfinite(summary.low):
        lines.append(f"{scale.write(summary.low, digits)} to {scale.write(summary.high, digits)}")
        lines.append(f"variance {scale.write_variance(summary.variance, summary.mean)}")
    if published is not None:
        lines.append(f"published {quantities.significant(published * scale.times, 4)}")
    small = "".join(f"<br><span class='range'>{escape(line)}</span>" for line in lines)
    return Html(f"{f'<b>{mean}</b>' if best else mean}{small}")


def _all_numbers(table: StudyTable, judgement: Judgement, group: CellGroup, metrics: Sequence[str]) -> str:
    """Per metric the count, median, variance and extremes as well, folded away."""
    rows = []
    for metric in metrics:
        scale = _scale(judgement, metric, table.members(group))
        head = f"{METRICS.find(metric).name}{scale.label}, variance in its square"
        rows.append([head])
        for cell in table.members(group):
            found = judgement.summaries[metric][cell.index]
            digits = scale.decimals(found.mean, found.low, found.high)
            numbers = (found.mean, found.low, found.high, found.median, found.smallest, found.largest)
            texts = [scale.write(number, digits) for number in numbers]
            texts.insert(4, scale.write_variance(found.variance, found.mean))
            rows.append([cell.text, str(found.n), *texts])
    names = ("n", "mean", "from", "to", "median", "variance", "smallest", "largest")
    columns = [("setting", ROW), *((name, PLAIN) for name in names)]
    what = f" of {group.name}" if len(table.groups) > 1 else ""
    return (
        f"<details><summary>All numbers{escape(what)}: count, median, variance, extremes</summary>"
        f"{markup.table(columns, rows, 'cells', box='wide')}</details>"
    )


def consistency_table(table: StudyTable) -> Section:
    """NEES and NIS pooled over the runs of each setting; left out where the study reports neither."""
    shown = [metric for metric in IDEALS if metric in table.metrics]
    columns = [("setting", ROW)]
    for m in shown:
        columns += [(f"{METRICS.find(m).name}, ideal {IDEALS[m]:g}", PLAIN), ("verdict", "")]
    parts = []
    for group in table.groups:
        rows = []
        for cell in table.members(group):
            pooled = [pool(table.column(m)[table.cell == cell.index], IDEALS[m]) for m in shown]
            if any(entry.n for entry in pooled):
                rows.append([cell.text, *(text for entry in pooled for text in _pooled(entry))])
        if rows:
            caption = f"<h3>{escape(group.name)}</h3>" if len(table.groups) > 1 else ""
            parts.append(caption + markup.table(columns, rows, "cells", box="wide"))
    note = (
        "<p>Means over the runs with their 95 % bands; runs are independent, the steps within one are not. "
        "A filter is overconfident where the whole band lies above the ideal value. NIS is told per degree "
        "of freedom, corrected for what the gate cuts off.</p>"
    )
    return section("consistency", "Consistency", *([note, *parts] if parts else []))


def _pooled(entry: Pooled) -> tuple[str, str]:
    if not entry.n:
        return quantities.NOTHING, ""
    scale = Scale()
    digits = scale.decimals(entry.mean, entry.low, entry.high)
    band = f"{scale.write(entry.low, digits)} to {scale.write(entry.high, digits)}"
    below = f"<br><span class='range'>{band}</span>" if math.isfinite(entry.low) else ""
    return Html(f"{scale.write(entry.mean, digits)}{below}"), entry.verdict


def endings_table(table: StudyTable) -> Section:
    """How many trials of each setting ended why; left out where all ended alike."""
    slug, title = "endings", "Why trials ended"
    kinds = [kind for kind, _ in Counter(table.ended).most_common()]
    if len(kinds) < 2:
        return section(slug, title)
    rows = []
    for cell in table.cells:
        found = Counter(table.ended[i] for i in np.flatnonzero(table.cell == cell.index))
        rows.append([cell.name, *(str(found[kind] or "") for kind in kinds)])
    columns = [("setting", ROW), *((kind or "not said", PLAIN) for kind in kinds)]
    return section(
        slug,
        title,
        "<p>Counted over the trials of each setting; in <code>trials.csv</code> the column "
        "<code>ended</code>, and in <code>ended_because</code> each trial&#x27;s own words.</p>",
        markup.table(columns, rows, "cells", box="wide"),
    )


def failures_table(table: StudyTable) -> Section:
    """Trials that gave no numbers, with the reason; left out where there are none."""
    rows = [
        (str(failure.row), table.cells[failure.cell].name, str(failure.seed), failure.reason)
        for failure in table.broken
    ]
    columns = (("row", VALUE), ("setting", ""), ("seed", VALUE), ("why", ""))
    made = markup.table(columns, rows, box="long") if rows else ""
    return section("failures", "Trials that broke", made)


def _scale(judgement: Judgement, metric: str, cells: Sequence[Cell]) -> Scale:
    """The unit of a metric's column: that of its means, so that one stray trial does not set it."""
    return scale_of(metric, [judgement.summaries[metric][cell.index].mean for cell in cells])


def _lower(table: StudyTable, judgement: Judgement, metric: str, group: CellGroup) -> bool | None:
    """Whether less of a metric is better in a group; None where neither is."""
    if metric == table.primary:
        return table.lower_is_better
    rates = [judgement.rates[index] for index in group.cells]
    if METRICS.find(metric).whole_runs and any(rate.successes < rate.trials for rate in rates):
        return None  # a trial that broke off early was not quick
    return METRICS.find(metric).less_is_better


def _differ(judgement: Judgement, metric: str, group: CellGroup) -> bool:
    means = [judgement.summaries[metric][index].mean for index in group.cells]
    finite = [mean for mean in means if math.isfinite(mean)]
    return len(finite) > 1 and min(finite) < max(finite)


def _rate(rate: Rate) -> Html:
    if not rate.trials:
        return Html(quantities.NOTHING)
    return Html(
        f"{rate.successes}/{rate.trials}<br><span class='range'>{100.0 * rate.low:.0f} to "
        f"{100.0 * rate.high:.0f}&nbsp;%</span>"
    )
