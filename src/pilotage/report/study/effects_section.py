"""The findings that a study's page begins with: what each factor does, the best settings, what stays open."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

from pilotage.evaluation.effects import FEWEST
from pilotage.evaluation.metric import words_and_unit
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.studies.findings import SETTING, Best, Finding
from pilotage.experiments.studies.table import StudyTable
from pilotage.report import markup
from pilotage.report.markup import PLAIN, ROW, Html, Section, escape, section
from pilotage.report.quantities import count, measured
from pilotage.report.study.scales import Scale, p_value, points, scale_of, told

MOST_LINES = 12
"""So many findings are told in words; the table has all."""
FEW_SETTINGS = 3
HEADS = ("n", "from", "to", "change", "95 % interval", "of the variance", "p, corrected", "would have shown")
HOW = (
    "Each factor&#x27;s effect with the other factors averaged out, and every two factors&#x27; interaction, "
    "by ranks ({tests}). p is corrected for all effects of the study (Holm&#x27;s, half of the chance kept "
    "for the metric that answers the question): of studies in which nothing has an effect, at most one in "
    "twenty tells of one. The last column is the change from the first to the last level that as many "
    "trials show in four of five studies, drawn from these trials&#x27; own values."
)
TOO_FEW = f"Effects are looked for from {FEWEST} trials on that give a metric at every setting."
PAIRED, APART = "Wilcoxon or Friedman, on the same seeds", "Mann and Whitney or Kruskal and Wallis"


def effects_section(table: StudyTable, findings: Sequence[Finding], best: Sequence[Best]) -> Section:
    """What the study found, in words and as a table; left out where there is nothing to compare."""
    if not findings:
        lines = [_best(table, entry) for entry in best if entry.metric == table.primary]
        return section("effects", "Findings", _list([TOO_FEW, *lines]) if lines else "")
    sure = sorted((f for f in findings if f.is_sure), key=lambda f: -f.effect.share)
    sure.sort(key=lambda f: f.metric != table.primary)
    lines = [_shown(table, finding) for finding in sure[:MOST_LINES]]
    if len(sure) > MOST_LINES:
        lines.append(f"{len(sure) - MOST_LINES} more effects are in the table below.")
    if not sure:
        lines.append("These trials tell no effect of any factor from chance.")
    lines += [_best(table, entry) for entry in best if _is_about(entry.metric, table, sure)]
    together = groupby(_unsure(findings), key=lambda f: (f.group, f.metric))
    open_ = [text for _, entries in together if (text := _open(table, list(entries)))]
    if table.primary not in {finding.metric for finding in findings}:
        open_.insert(0, f"Nothing of {METRICS.find(table.primary).name}. {TOO_FEW}")
    rest = f"<h3>What these trials cannot tell</h3>{_list(open_[:MOST_LINES])}" if open_ else ""
    how = HOW.format(tests=PAIRED if table.same_seeds else APART)
    made = f"<details><summary>All effects</summary><p>{how}</p>{_tables(table, findings)}</details>"
    return section("effects", "Findings", _list(lines), rest, made)


def _list(texts: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def _is_about(metric: str, table: StudyTable, sure: Sequence[Finding]) -> bool:
    return metric == table.primary or any(finding.metric == metric for finding in sure)


def _unsure(findings: Sequence[Finding]) -> list[Finding]:
    """Effects that may be there: what never varies has been told."""
    return [f for f in findings if not f.is_sure and math.isfinite(f.effect.p_value)]


def factor_words(factor: str) -> str:
    """A factor as it is said; the settings together where no factors span them."""
    return "the setting" if factor == SETTING else words_and_unit(factor)[0]


def level_words(table: StudyTable, factor: str, level: Any) -> str:
    """A level with its unit."""
    if factor == SETTING:
        return next((cell.text for cell in table.cells if cell.name == level), str(level))
    unit = table.unit(factor)
    text = table.study.definition.said(factor, level)
    return f"{text}\u00a0{unit}" if unit and isinstance(level, int | float) else text


def _metric(finding: Finding) -> str:
    name = METRICS.find(finding.metric).name
    group = f" ({finding.group})" if finding.group else ""
    return f"{name if name[:2].isupper() else name[:1].upper() + name[1:]}{group}"


def _ends(table: StudyTable, finding: Finding) -> tuple[str, str]:
    factor, levels = finding.factors[-1], finding.levels[-1]
    first, last = (level_words(table, factor, levels[end]) for end in finding.effect.ends)
    return first, last


def _shown(table: StudyTable, finding: Finding) -> str:
    """A sure effect in one sentence."""
    effect, change = finding.effect, finding.effect.change()
    by = points(told(finding.metric, change.mean, change.low, change.high, signed=True))
    first, last = _ends(table, finding)
    evidence = f"{100.0 * effect.share:.0f}\u00a0% of the variance, {p_value(finding.p_corrected, 'p ')}"
    factors = [factor_words(factor) for factor in finding.factors]
    without = _without(table, finding)
    if len(factors) == 2:
        one, other = factors
        ends = [level_words(table, finding.factors[0], finding.levels[0][end]) for end in (0, -1)]
        return (
            f"{_metric(finding)}: {one} and {other} act together: the change from {ends[0]} to {ends[1]} of "
            f"{one} differs by {by} between {first} and {last} of {other} ({evidence}){without}."
        )
    start, end = (told(finding.metric, float(effect.means[i]), math.nan, math.nan) for i in effect.ends)
    return (
        f"{_metric(finding)} depends on {factors[0]}: {start} at {first}, {end} at {last}, "
        f"a change by {by} ({evidence}){_inner(table, finding)}{without}."
    )


def _without(table: StudyTable, finding: Finding) -> str:
    """Which levels were left out, because no trial at them gives the metric."""
    names = [level_words(table, factor, level) for factor, level in finding.without]
    return f"; without {', '.join(names)}, where no trial gives it" if names else ""


def _inner(table: StudyTable, finding: Finding) -> str:
    """Where the metric is lowest or highest between the ends."""
    means, (first, last) = finding.effect.means, finding.effect.ends
    out = []
    for word, index in (("lowest", int(means.argmin())), ("highest", int(means.argmax()))):
        if index not in (first, last):
            level = level_words(table, finding.factors[0], finding.levels[0][index])
            out.append(f"{word} at {level}, {told(finding.metric, float(means[index]), math.nan, math.nan)}")
    return f"; {', '.join(out)}" if out else ""


def _best(table: StudyTable, best: Best) -> str:
    """The best setting, and how many are as good for all that these trials tell."""
    metric, summary = METRICS.find(best.metric), best.summary
    name = f"Best {metric.name}"
    if metric.less_is_better is None and math.isfinite(metric.ideal):
        name = f"{metric.name} nearest to {metric.ideal:g}"
    text = (
        f"{name}{f' ({best.group})' if best.group else ''}: {table.cells[best.cell].text}, "
        f"{told(best.metric, summary.mean, summary.low, summary.high)}"
    )
    if not best.also:
        return f"{text}; every other setting is worse beyond chance."
    if best.needed:
        return f"{text}; to tell any two settings apart takes at least {best.needed} trials of each."
    named = ", ".join(f"'{table.cells[index].text}'" for index in best.also)
    also = named if len(best.also) <= FEW_SETTINGS else f"{len(best.also)} other settings"
    return f"{text}; not told from it by these trials: {also}."


def _open(table: StudyTable, findings: Sequence[Finding]) -> str:
    """Which effects on one metric were not told, and how large they would have had to be."""
    parts = []
    for finding in findings:
        effect = finding.effect
        factors = " with ".join(factor_words(factor) for factor in finding.factors)
        detectable = effect.detectable()
        if not math.isfinite(detectable):
            continue
        size = points(measured(detectable, METRICS.find(finding.metric).unit))
        needed = effect.needed()
        more = f"; the one seen would take about {count(needed)}" if effect.n < needed < 1e6 else ""
        parts.append(f"{factors} (a change of {size} would have shown{more})")
    if not parts:
        return ""
    about = f"{_metric(findings[0])}, {count(findings[0].effect.n)} trials a setting"
    return f"{about}: nothing told of {', '.join(parts)}{_without(table, findings[0])}."


def _tables(table: StudyTable, findings: Sequence[Finding]) -> str:
    columns = [("factor", ROW), *((name, PLAIN) for name in HEADS)]
    parts = []
    for _, entries in groupby(findings, key=lambda f: (f.group, f.metric)):
        rows = list(entries)
        scale = scale_of(rows[0].metric, [float(value) for f in rows for value in f.effect.means.ravel()])
        made = markup.table(columns, [_row(table, f, scale) for f in rows], "cells", box="wide")
        parts.append(f"<h3>{escape(_metric(rows[0]) + scale.label)}</h3>{made}")
    return "".join(parts)


def _row(table: StudyTable, finding: Finding, scale: Scale) -> list[str]:
    effect, change = finding.effect, finding.effect.change()
    digits = scale.decimals(change.mean, change.low, change.high)
    mean, low, high, size = (
        scale.write(value, digits, signed=signed)
        for value, signed in (
            *((value, True) for value in (change.mean, change.low, change.high)),
            (effect.detectable(), False),
        )
    )
    band = f"{low} to {high}" if math.isfinite(change.low) else "–"
    share = f"{100.0 * effect.share:.1f} %"
    texts = (str(effect.n), *_ends(table, finding), mean, band, share, p_value(finding.p_corrected), size)
    name = " with ".join(factor_words(factor) for factor in finding.factors)
    return [Html(f"<b>{escape(name)}</b>") if finding.is_sure else name, *texts]
