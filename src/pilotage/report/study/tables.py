"""The study's tables: one row a cell, one row a comparison, one row a failure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pilotage.evaluation.judge import Judgement, Rate
from pilotage.evaluation.pooled import NEES_IDEAL, NIS_IDEAL, pool
from pilotage.report import quantities
from pilotage.report.markup import escape
from pilotage.report.metrics_table import metric_of
from pilotage.report.study.answer import SURE, best_cell
from pilotage.report.study.view import StudyView

LOWER_IS_BETTER = ("_m", "_rad", "_s", "smoothness", "collisions", "replans", "attempts", "escapes")
IDEAL = ("nees", "nis")
"""Best where they are near their ideal value, which a mean alone does not tell."""


def cells_table(view: StudyView, judgement: Judgement, lower: dict[str, bool]) -> str:
    """Mean, interval and variance of each metric in each cell, beside what was published."""
    best = {m: best_cell(judgement, m, lower[m]) for m in view.metrics if not m.startswith(IDEAL)}
    head = "".join(f'<th scope="col" class="value">{escape(metric_of(m).name)}</th>' for m in view.metrics)
    rows = []
    for cell in view.cells:
        rate = judgement.rates[cell.index]
        parts = [f'<th scope="row">{escape(cell.name)}</th><td class="value">{_rate(rate)}</td>']
        for name in view.metrics:
            summary = judgement.summaries[name][cell.index]
            text = _mean(name, summary.mean, best.get(name) == cell.index and len(view.cells) > 1)
            small = []
            if math.isfinite(summary.low):
                write = metric_of(name).write
                small.append(f"{write(summary.low)} to {write(summary.high)}")
                small.append(f"median {write(summary.median)}, variance {_scientific(summary.variance)}")
            if name in cell.published:
                small.append(f"published {metric_of(name).write(cell.published[name])}")
            inner = "".join(f"<br><span class='range'>{escape(line)}</span>" for line in small)
            parts.append(f'<td class="value plain">{text}{inner}</td>')
        rows.append(f"<tr>{''.join(parts)}</tr>")
    return (
        '<section id="cells"><h2><a href="#cells">Every setting</a></h2>'
        "<p>Mean over the trials; below it the 95 % bootstrap interval of the mean, the median and the "
        "variance. The best mean of a column is bold. Success with its 95 % Wilson interval.</p>"
        '<div class="wide"><table class="cells"><thead><tr><th scope="col">setting</th>'
        f'<th scope="col" class="value">success</th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
        "</section>"
    )


def comparisons_table(view: StudyView, judgement: Judgement) -> str:
    """Every cell against the baseline; empty where there is none."""
    if view.baseline is None or len(view.cells) < 2:
        return ""
    rows = []
    for name in view.metrics:
        metric = metric_of(name)
        rows.append(f'<tr class="group"><th colspan="6" scope="rowgroup">{escape(metric.name)}</th></tr>')
        for cell in view.cells:
            found = judgement.differences[name][cell.index]
            if found is None or found.n == 0:
                continue
            sure = math.isfinite(found.p_corrected) and found.p_corrected < SURE
            band = f"{metric.write(found.low)} to {metric.write(found.high)}"
            p_text = f"{found.p_corrected:.2g}" if math.isfinite(found.p_corrected) else quantities.NOTHING
            rows.append(
                f'<tr><th scope="row">{escape(cell.name)}</th>'
                f'<td class="value">{escape(metric.write(found.mean))}</td>'
                f'<td class="value plain">{escape(band)}</td>'
                f'<td class="value plain">{p_text}</td><td class="value plain">{found.effect:+.2f}</td>'
                f"<td>{'differs' if sure else 'not told from chance'}</td></tr>"
            )
    base = escape(view.cells[view.baseline].name)
    return (
        f'<section id="comparisons"><h2><a href="#comparisons">Against {base}</a></h2>'
        "<p>Differences between trials with the same seed: their mean with its 95 % bootstrap interval; p "
        "from Wilcoxon&#x27;s signed-rank test (for success from McNemar&#x27;s exact test), corrected for "
        "all comparisons on this page (Benjamini and Yekutieli); effect: matched-pairs rank-biserial "
        "correlation, 1 where every pair grows.</p>"
        '<div class="wide"><table class="comparisons"><thead><tr><th scope="col">setting</th>'
        '<th scope="col" class="value">difference</th><th scope="col" class="value">95 % interval</th>'
        '<th scope="col" class="value">p, corrected</th><th scope="col" class="value">effect</th>'
        f'<th scope="col">verdict</th></tr></thead><tbody>{"".join(rows)}</tbody></table></div></section>'
    )


def consistency_table(view: StudyView) -> str:
    """NEES and NIS pooled over the runs of each cell; empty where the study has neither."""
    rows = []
    for key, title, ideal in (
        ("nees_mean", "NEES", NEES_IDEAL),
        ("nis_mean", "NIS per degree of freedom", NIS_IDEAL),
    ):
        if key not in view.values:
            continue
        for cell in view.cells:
            pooled = pool(view.column(key)[view.cell == cell.index], ideal)
            if pooled.n:
                low, high = quantities.significant(pooled.low), quantities.significant(pooled.high)
                rows.append(
                    f'<tr><th scope="row">{escape(cell.name)}</th><td>{title}</td>'
                    f'<td class="value">{quantities.significant(pooled.mean)}</td>'
                    f'<td class="value plain">{low} to {high}</td><td class="value plain">{ideal:g}</td>'
                    f"<td>{pooled.verdict}</td></tr>"
                )
    if not rows:
        return ""
    return (
        '<section id="consistency"><h2><a href="#consistency">Consistency</a></h2>'
        "<p>Means over the runs with their 95 % bands; runs are independent, the steps within one are not. "
        "A filter is overconfident where the whole band lies above the ideal value.</p>"
        '<div class="wide"><table><thead><tr><th scope="col">setting</th><th scope="col">statistic</th>'
        '<th scope="col" class="value">mean</th><th scope="col" class="value">95 % band</th>'
        '<th scope="col" class="value">ideal</th><th scope="col">verdict</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def failures_table(view: StudyView) -> str:
    """Trials that gave no numbers, with the reason; empty where there are none."""
    if not view.failures:
        return ""
    rows = "".join(
        f'<tr><td class="value">{failure.row}</td><td>{escape(view.cells[failure.cell].name)}</td>'
        f'<td class="value">{failure.seed}</td><td>{escape(failure.reason)}</td></tr>'
        for failure in view.failures
    )
    return (
        '<section id="failures"><h2><a href="#failures">Trials that broke</a></h2>'
        '<div class="long"><table><thead><tr><th scope="col" class="value">row</th>'
        '<th scope="col">setting</th>'
        '<th scope="col" class="value">seed</th><th scope="col">why</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div></section>"
    )


def _mean(name: str, value: float, best: bool) -> str:
    text = escape(metric_of(name).write(value))
    return f"<b>{text}</b>" if best else text


def _rate(rate: Rate) -> str:
    if not rate.trials:
        return quantities.NOTHING
    return (
        f"{rate.successes}/{rate.trials}<br><span class='range'>{100.0 * rate.low:.0f} to "
        f"{100.0 * rate.high:.0f}&nbsp;%</span>"
    )


def _scientific(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else quantities.NOTHING


def lower_is_better(metrics: Sequence[str]) -> dict[str, bool]:
    """Which way is better, by the metric's name: errors, lengths and times down, all else up."""
    return {name: name.endswith(LOWER_IS_BETTER) for name in metrics}
