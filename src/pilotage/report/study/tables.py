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
from pilotage.report import quantities
from pilotage.report.markup import escape
from pilotage.report.study.answer import best_cell
from pilotage.report.study.scales import Scale, scale_of


def cells_table(table: StudyTable, judgement: Judgement) -> str:
    """Mean and interval of each metric in each setting, beside what was published; all numbers folded."""
    parts = [_group_table(table, judgement, group) for group in table.groups]
    published = any(cell.published for cell in table.cells)
    return (
        '<section id="cells"><h2><a href="#cells">Every setting</a></h2>'
        "<p>Means over the trials; below each its 95 % bootstrap interval, the variance in the square of the "
        f"column&#x27;s unit{', and what was published' if published else ''}. The best mean of a column is "
        f"bold. Success with its 95 % Wilson interval.{_of_few(table)}</p>{''.join(parts)}</section>"
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
    head = "".join(
        f'<th scope="col" class="value">{escape(METRICS.find(m).name)}{scales[m].label}</th>' for m in metrics
    )
    rows = []
    for cell in table.members(group):
        parts = [
            f'<th scope="row">{escape(cell.text)}</th><td class="value">{_rate(judgement.rates[cell.index])}'
        ]
        parts += [
            _entry(
                judgement.summaries[m][cell.index],
                scales[m],
                best.get(m) == cell.index,
                cell.published.get(m),
            )
            for m in metrics
        ]
        rows.append(f"<tr>{'</td>'.join(parts)}</td></tr>")
    caption = f"<h3>{escape(group.name)}</h3>" if len(table.groups) > 1 else ""
    return (
        f'{caption}<div class="wide" tabindex="0"><table class="cells"><thead><tr>'
        f'<th scope="col">setting</th><th scope="col" class="value">success</th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>{_all_numbers(table, judgement, group, given)}"
    )


def _entry(summary: Summary, scale: Scale, best: bool, published: float | None) -> str:
    digits = scale.decimals(summary.mean, summary.low, summary.high)
    mean = scale.write(summary.mean, digits)
    lines = []
    if math.isfinite(summary.low):
        lines.append(f"{scale.write(summary.low, digits)} to {scale.write(summary.high, digits)}")
        lines.append(f"variance {scale.write_variance(summary.variance, summary.mean)}")
    if published is not None:
        lines.append(f"published {quantities.significant(published * scale.times, 4)}")
    small = "".join(f"<br><span class='range'>{escape(line)}</span>" for line in lines)
    return f'<td class="value plain">{f"<b>{mean}</b>" if best else mean}{small}'


def _all_numbers(table: StudyTable, judgement: Judgement, group: CellGroup, metrics: Sequence[str]) -> str:
    """Per metric the count, median, variance and extremes as well, folded away."""
    rows = []
    for metric in metrics:
        scale = _scale(judgement, metric, table.members(group))
        head = f"{METRICS.find(metric).name}{scale.label}, variance in its square"
        rows.append(f'<tr class="group"><th colspan="8" scope="rowgroup">{escape(head)}</th></tr>')
        for cell in table.members(group):
            found = judgement.summaries[metric][cell.index]
            digits = scale.decimals(found.mean, found.low, found.high)
            numbers = (found.mean, found.low, found.high, found.median, found.smallest, found.largest)
            texts = [scale.write(number, digits) for number in numbers]
            texts.insert(4, scale.write_variance(found.variance, found.mean))
            values = "".join(f'<td class="value plain">{text}</td>' for text in (str(found.n), *texts))
            rows.append(f'<tr><th scope="row">{escape(cell.text)}</th>{values}</tr>')
    names = ("n", "mean", "from", "to", "median", "variance", "smallest", "largest")
    heads = "".join(f'<th scope="col" class="value">{name}</th>' for name in names)
    what = f" of {group.name}" if len(table.groups) > 1 else ""
    return (
        f"<details><summary>All numbers{escape(what)}: count, median, variance, extremes</summary>"
        f'<div class="wide" tabindex="0"><table class="cells"><thead><tr><th scope="col">setting</th>{heads}'
        f"</tr></thead><tbody>{''.join(rows)}</tbody></table></div></details>"
    )


def consistency_table(table: StudyTable) -> str:
    """NEES and NIS pooled over the runs of each setting; empty where the study reports neither."""
    shown = [metric for metric in IDEALS if metric in table.metrics]
    tables = []
    for group in table.groups:
        rows = []
        for cell in table.members(group):
            pooled = [pool(table.column(m)[table.cell == cell.index], IDEALS[m]) for m in shown]
            if any(entry.n for entry in pooled):
                rows.append(
                    f'<tr><th scope="row">{escape(cell.text)}</th>{"".join(map(_pooled, pooled))}</tr>'
                )
        if rows:
            head = "".join(
                f'<th scope="col" class="value">{METRICS.find(m).name}, ideal {IDEALS[m]:g}</th>'
                '<th scope="col">verdict</th>'
                for m in shown
            )
            caption = f"<h3>{escape(group.name)}</h3>" if len(table.groups) > 1 else ""
            tables.append(
                f'{caption}<div class="wide" tabindex="0"><table class="cells"><thead><tr>'
                f'<th scope="col">setting</th>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'
            )
    if not tables:
        return ""
    return (
        '<section id="consistency"><h2><a href="#consistency">Consistency</a></h2>'
        "<p>Means over the runs with their 95 % bands; runs are independent, the steps within one are not. "
        "A filter is overconfident where the whole band lies above the ideal value. NIS is told per degree "
        f"of freedom, corrected for what the gate cuts off.</p>{''.join(tables)}</section>"
    )


def _pooled(entry: Pooled) -> str:
    if not entry.n:
        return f'<td class="value plain">{quantities.NOTHING}</td><td></td>'
    scale = Scale()
    digits = scale.decimals(entry.mean, entry.low, entry.high)
    band = f"{scale.write(entry.low, digits)} to {scale.write(entry.high, digits)}"
    below = f"<br><span class='range'>{band}</span>" if math.isfinite(entry.low) else ""
    return f'<td class="value plain">{scale.write(entry.mean, digits)}{below}</td><td>{entry.verdict}</td>'


def endings_table(table: StudyTable) -> str:
    """How many trials of each setting ended why; empty where all ended alike."""
    kinds = [kind for kind, _ in Counter(table.ended).most_common()]
    if len(kinds) < 2:
        return ""
    head = "".join(f'<th scope="col" class="value">{escape(kind) or "not said"}</th>' for kind in kinds)
    rows = []
    for cell in table.cells:
        found = Counter(table.ended[i] for i in np.flatnonzero(table.cell == cell.index))
        counts = "".join(f'<td class="value plain">{found[kind] or ""}</td>' for kind in kinds)
        rows.append(f'<tr><th scope="row">{escape(cell.name)}</th>{counts}</tr>')
    return (
        '<section id="endings"><h2><a href="#endings">Why trials ended</a></h2>'
        "<p>Counted over the trials of each setting; in <code>trials.csv</code> the column "
        "<code>ended</code>, and in <code>ended_because</code> each trial&#x27;s own words.</p>"
        f'<div class="wide" tabindex="0"><table class="cells"><thead><tr><th scope="col">setting</th>{head}'
        f"</tr></thead><tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def failures_table(table: StudyTable) -> str:
    """Trials that gave no numbers, with the reason; empty where there are none."""
    if not table.broken:
        return ""
    rows = "".join(
        f'<tr><td class="value">{failure.row}</td><td>{escape(table.cells[failure.cell].name)}</td>'
        f'<td class="value">{failure.seed}</td><td>{escape(failure.reason)}</td></tr>'
        for failure in table.broken
    )
    return (
        '<section id="failures"><h2><a href="#failures">Trials that broke</a></h2>'
        '<div class="long"><table><thead><tr><th scope="col" class="value">row</th>'
        '<th scope="col">setting</th>'
        '<th scope="col" class="value">seed</th><th scope="col">why</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div></section>"
    )


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


def _rate(rate: Rate) -> str:
    if not rate.trials:
        return quantities.NOTHING
    return (
        f"{rate.successes}/{rate.trials}<br><span class='range'>{100.0 * rate.low:.0f} to "
        f"{100.0 * rate.high:.0f}&nbsp;%</span>"
    )
