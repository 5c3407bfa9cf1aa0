"""Every setting against its baseline, and one metric against another, on the same trials."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pilotage.evaluation.judge import Judgement
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.paired import Difference
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report import markup
from pilotage.report.markup import PLAIN, ROW, VALUE, Section, escape, section
from pilotage.report.study.answer import SURE
from pilotage.report.study.scales import Scale, p_value, scale_of

Row = tuple[str, Difference]
PAIRED = (
    "Differences between trials with the same seed: their mean with its 95 % bootstrap interval, and "
    "their median; p from Wilcoxon&#x27;s signed-rank test (for success from McNemar&#x27;s "
    "exact test), corrected for all comparisons on this page "
    "(Benjamini and Yekutieli); effect: matched-pairs rank-biserial correlation, 1 where every pair "
    "grows, −1 where every pair shrinks."
)
APART = (
    "Every setting has seeds of its own: the difference of the means with its 95 % bootstrap interval, and "
    "the median of all differences (Hodges and Lehmann); p from Mann and Whitney&#x27;s test (for success "
    "from Fisher&#x27;s exact test), corrected for all comparisons on this page (Benjamini and Yekutieli); "
    "effect: rank-biserial correlation, 1 where every trial is above every one of the other setting&#x27;s, "
    "−1 where below. The same seeds would tell smaller differences."
)
HEADS = ("difference", "95 % interval", "median", "p, corrected", "effect")


def comparisons_table(table: StudyTable, judgement: Judgement) -> Section:
    """Differences on the same seeds, one folding table a metric; left out where nothing is compared."""
    parts = []
    success = table.column("success")
    told_apart = (*table.metrics, "success") if bool(np.any(success == 0.0)) else table.metrics
    for group in table.groups:
        tables = [
            html
            for metric in told_apart
            if (html := _table(metric, list(_rows(table, judgement, group, metric)), metric == table.primary))
        ]
        if tables:
            base = group.baseline
            against = "" if base is None else f" against {table.cells[base].text}"
            title = f"{group.name}{',' if against else ''}" if len(table.groups) > 1 else "Every setting"
            parts.append(f"<h3>{escape(f'{title}{against}')}</h3>{''.join(tables)}")
    for pair, found in judgement.contrasts.items():
        rows = [(cell.text, found[cell.index]) for cell in table.cells if found[cell.index].n]
        if rows:
            names = [METRICS.find(name).name for name in pair]
            parts.append(
                f"<h3>{escape(f'{names[0]} less {names[1]}, within each trial')}</h3>"
                f"{_table(pair[0], rows, True)}"
            )
    note = f"<p>{PAIRED if table.same_seeds else APART}</p>"
    return section("comparisons", "Comparisons", *([note, *parts] if parts else []))


def _rows(table: StudyTable, judgement: Judgement, group: CellGroup, metric: str) -> Iterator[Row]:
    for index, base in zip(group.cells, group.baselines, strict=True):
        found = judgement.differences[metric][index]
        if base is None or found is None or found.n == 0:
            continue
        against = "" if group.baseline is not None else f" against {table.known_as(base, group)}"
        yield f"{table.cells[index].text}{against}", found


def _table(metric: str, rows: list[Row], shown: bool) -> str:
    if not rows or (not shown and all(found.low == found.high == 0.0 for _, found in rows)):
        return ""
    scale = scale_of(metric, [found.mean for _, found in rows])
    unit = " [percentage points]" if scale.unit == "%" else scale.label
    columns = [("setting", ROW), (HEADS[0], VALUE), *((name, PLAIN) for name in HEADS[1:]), ("verdict", "")]
    made = markup.table(columns, [_row(name, found, scale) for name, found in rows], "cells", box="wide")
    title = escape(METRICS.find(metric).name + unit)
    return f"<details{' open' if shown else ''}><summary>{title}</summary>{made}</details>"


def _row(name: str, found: Difference, scale: Scale) -> tuple[str, ...]:
    digits = scale.decimals(found.mean, found.low, found.high)
    mean, low, high, median = (
        scale.write(value, digits, signed=True) for value in (found.mean, found.low, found.high, found.median)
    )
    effect = f"{found.effect:+.2f}".replace("-", "−")
    band = f"{low} to {high}" if math.isfinite(found.low) else "–"
    return name, mean, band, median, p_value(found.p_corrected), effect, verdict(found)


def verdict(found: Difference) -> str:
    """What the test and the interval say together: they look at ranks and at the mean."""
    if found.low == found.high == 0.0:
        return "no trial differs"
    if not math.isfinite(found.p_corrected) or found.p_corrected >= SURE:
        return "not told from chance"
    if found.low > 0.0 and found.effect > 0.0:
        return "higher"
    if found.high < 0.0 and found.effect < 0.0:
        return "lower"
    return f"{'higher' if found.effect > 0.0 else 'lower'} in most trials, not surely in the mean"
