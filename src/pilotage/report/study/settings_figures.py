"""Settings side by side: every trial, the mean and its interval, one figure a group of settings."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pilotage.evaluation.judge import Judgement
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.light_axes import LightAxes
from pilotage.report.study.factor_figures import lines_over
from pilotage.report.study.panels import (
    dots_of,
    drawable,
    is_wide,
    reference_line,
    references,
    scale_for,
    set_log,
    title,
)
from pilotage.report.style import BLUE, FAINT, MUTED, ORANGE, WIDTH_PT, Illustration, Key, render

PANELS_ACROSS = 2
RIGHT_PT, TOP_PT, BOTTOM_PT, GAP_X_PT = 12.0, 24.0, 30.0, 24.0
ROW_PT, LETTER_PT = 17.0, 5.3
MAX_LABEL = 44


def settings_figures(table: StudyTable, judgement: Judgement) -> list[Illustration]:
    """One figure a group whose settings differ in more than the numbers that the other figures are over."""
    several = len(table.groups) > 1
    out = []
    for number, group in enumerate(table.groups, start=1):
        cells = table.members(group)
        drawn = {
            cell.index for f in table.factors for _, line in lines_over(table, cells, f) for cell in line
        }
        if len(cells) < 2 or drawn.issuperset(group.cells) or not drawable(table, cells):
            continue
        slug = f"settings-{number}" if several else "settings"
        name = f"Side by side: {group.name}" if several else "Settings side by side"
        out.append(_figure(table, judgement, group, slug, name))
    return out


def _figure(table: StudyTable, judgement: Judgement, group: CellGroup, slug: str, name: str) -> Illustration:
    cells = table.members(group)
    metrics = drawable(table, cells)
    panel = len(cells) * ROW_PT
    height = TOP_PT + panel + BOTTOM_PT
    longest = max(len(cell.text) for cell in cells)
    label_pt = 14.0 + LETTER_PT * min(longest, MAX_LABEL)
    rows = math.ceil(len(metrics) / PANELS_ACROSS)
    total = height * rows
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    width = (WIDTH_PT - label_pt - RIGHT_PT - GAP_X_PT * (PANELS_ACROSS - 1)) / PANELS_ACROSS
    for number, metric in enumerate(metrics):
        line, across = divmod(number, PANELS_ACROSS)
        left = label_pt + across * (width + GAP_X_PT)
        bottom = total - line * height - TOP_PT - panel
        axes = figure.add_axes(
            (left / WIDTH_PT, bottom / total, width / WIDTH_PT, panel / total), axes_class=LightAxes
        )
        _panel(axes, table, judgement, metric, cells, labelled=across == 0)
    keys = [Key("mean with its 95 % interval", BLUE, "spot"), Key("a trial", FAINT, "spot")]
    if any(metric in cell.published for cell in cells for metric in metrics):
        keys.append(Key("published", ORANGE, "spot"))
    keys += [Key(text, MUTED, "dash") for metric, text in references(table).items() if metric in metrics]
    alt = f"The {len(cells)} settings of the study {table.study.name}, with their trials and their means."
    caption = "Each setting's trials and their mean with its 95 % bootstrap interval."
    if table.same_seeds:
        caption += " Settings share their seeds: comparisons of pairs are sharper than overlapping intervals."
    return Illustration(slug, name, alt, caption, render(figure, slug, alt), tuple(keys))


def _panel(
    axes: Axes, table: StudyTable, judgement: Judgement, metric: str, cells: list[Cell], *, labelled: bool
) -> None:
    """One metric in all settings, one row each, the first on top."""
    scale = scale_for(judgement, metric, cells)
    title(axes, metric, scale)
    found = [judgement.summaries[metric][cell.index] for cell in cells]
    if is_wide([summary.mean for summary in found], [summary.smallest for summary in found]):
        set_log(axes, "x")
    else:
        axes.xaxis.set_major_locator(MaxNLocator(5))
    column, count = table.column(metric) * scale.times, len(cells)
    for row, (cell, summary) in enumerate(zip(cells, found, strict=True)):
        y = count - 1 - row
        trials = column[table.cell == cell.index]
        spread = np.linspace(-0.22, 0.22, trials.size) if trials.size > 1 else np.zeros(trials.size)
        axes.plot(trials, y + spread, color=FAINT, alpha=0.8, **dots_of(trials.size))
        if math.isfinite(summary.mean):
            mean = summary.mean * scale.times
            low = summary.low * scale.times if math.isfinite(summary.low) else mean
            high = summary.high * scale.times if math.isfinite(summary.high) else mean
            axes.plot([low, high], [y, y], color=BLUE, linewidth=2.2, solid_capstyle="butt", zorder=3.0)
            axes.plot([mean], [y], "D", color=BLUE, markersize=4.5, zorder=3.5)
        if metric in cell.published:
            at = cell.published[metric] * scale.times
            axes.plot([at], [y], "D", color=ORANGE, markersize=4.5, zorder=3.2)
    reference_line(axes, table, metric, scale, upright=True)
    axes.set_ylim(-0.6, count - 0.4)
    names = [_clipped(cell.text) for cell in reversed(cells)] if labelled else [""] * count
    axes.set_yticks(range(count), names)
    axes.margins(x=0.06)


def _clipped(text: str) -> str:
    return text if len(text) <= MAX_LABEL else text[: MAX_LABEL - 1] + "…"
