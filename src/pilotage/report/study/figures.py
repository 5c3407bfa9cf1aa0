"""The study's figures: each metric over each factor, and settings side by side, all with intervals."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pilotage.evaluation.intervals import Summary
from pilotage.evaluation.judge import Judgement
from pilotage.report.metrics_table import metric_of
from pilotage.report.study.view import Cell, StudyView
from pilotage.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH_PT,
    Illustration,
    Key,
    render,
)

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, SKY, INK)
PANELS_ACROSS = 2
PANEL_PT, GAP_X_PT, GAP_Y_PT = 130.0, 62.0, 52.0
LEFT_PT, RIGHT_PT, TOP_PT, BOTTOM_PT = 56.0, 12.0, 24.0, 40.0
ROW_PT = 17.0
MAX_LABEL = 44


def factor_figures(view: StudyView, judgement: Judgement) -> list[Illustration]:
    """One figure a numeric factor, one panel a metric."""
    out = []
    for factor in view.factors:
        lines = _lines(view, factor)
        if lines:
            out.append(_factor_figure(view, judgement, factor, lines))
    return out


def settings_figure(view: StudyView, judgement: Judgement) -> Illustration | None:
    """All settings side by side, where they differ in more than numbers."""
    if len(view.cells) < 2 or all(_lines(view, factor) for factor in view.factors):
        return None
    metrics = _drawable(view)
    height = TOP_PT + len(view.cells) * ROW_PT + BOTTOM_PT
    label_pt = 6.0 + 5.0 * min(max(len(cell.name) for cell in view.cells), MAX_LABEL)
    rows = math.ceil(len(metrics) / PANELS_ACROSS)
    total = height * rows
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    width = (WIDTH_PT - label_pt - RIGHT_PT - 24.0 * (PANELS_ACROSS - 1)) / PANELS_ACROSS
    for number, metric in enumerate(metrics):
        line, across = divmod(number, PANELS_ACROSS)
        left = label_pt + across * (width + 24.0)
        bottom = total - line * height - TOP_PT - len(view.cells) * ROW_PT
        box = (left / WIDTH_PT, bottom / total, width / WIDTH_PT, len(view.cells) * ROW_PT / total)
        axes = figure.add_axes(box)
        _settings_panel(axes, view, judgement, metric, across == 0)
    keys = [Key("mean with its 95 % interval", BLUE, "spot"), Key("a trial", FAINT, "spot")]
    if any(cell.published for cell in view.cells):
        keys.append(Key("published", ORANGE, "spot"))
    alt = (
        f"Every setting of the study {view.name}, {len(view.cells)} of them, with its trials and their mean."
    )
    caption = (
        "Each setting's trials and their mean with its 95 % bootstrap interval. Settings share their seeds, "
        "so the comparisons below are sharper than overlapping intervals look."
    )
    return Illustration(
        "settings", "Settings side by side", alt, caption, render(figure, "settings", alt), tuple(keys)
    )


def _factor_figure(
    view: StudyView, judgement: Judgement, factor: str, lines: Sequence[tuple[str, Sequence[Cell]]]
) -> Illustration:
    metrics = _drawable(view)
    rows = math.ceil(len(metrics) / PANELS_ACROSS)
    total = TOP_PT + rows * PANEL_PT + (rows - 1) * GAP_Y_PT + BOTTOM_PT
    width = (WIDTH_PT - LEFT_PT - RIGHT_PT - GAP_X_PT * (PANELS_ACROSS - 1)) / PANELS_ACROSS
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    for number, metric in enumerate(metrics):
        line, across = divmod(number, PANELS_ACROSS)
        left = LEFT_PT + across * (width + GAP_X_PT)
        bottom = total - TOP_PT - PANEL_PT - line * (PANEL_PT + GAP_Y_PT)
        axes = figure.add_axes((left / WIDTH_PT, bottom / total, width / WIDTH_PT, PANEL_PT / total))
        _factor_panel(axes, view, judgement, factor, metric, lines)
    keys = [Key(label, COLOURS[i % len(COLOURS)]) for i, (label, _) in enumerate(lines)]
    if any(cell.published for _, cells in lines for cell in cells):
        keys.append(Key("published", ORANGE, "spot"))
    keys += [Key(text, MUTED, "dash") for metric, (text, _) in view.reference.items() if metric in metrics]
    slug = f"factor-{factor.replace('.', '-').replace('_', '-')}"
    short = view.short(factor)
    alt = f"The study's metrics over {short}: means with 95 % intervals."
    caption = (
        f"Means over the trials at each {short}, with 95 % bootstrap intervals; small dots are single trials."
    )
    return Illustration(slug, f"Over {short}", alt, caption, render(figure, slug, alt), tuple(keys))


def _factor_panel(
    axes: Axes,
    view: StudyView,
    judgement: Judgement,
    factor: str,
    metric: str,
    lines: Sequence[tuple[str, Sequence[Cell]]],
) -> None:
    """One metric over one factor."""
    axes.set_title(metric_of(metric).name + _unit(metric))
    axes.set_xlabel(view.short(factor), labelpad=3.0)
    xs = sorted({float(cell.values[factor]) for _, cells in lines for cell in cells})  # type: ignore[arg-type]
    log = len(xs) > 2 and xs[0] > 0.0 and xs[-1] / xs[0] >= 30.0
    if log:
        axes.set_xscale("log")
    step = (math.log10(xs[-1] / xs[0]) if log else xs[-1] - xs[0]) / max(len(xs) - 1, 1)
    column = view.column(metric)
    for number, (_, cells) in enumerate(lines):
        colour = COLOURS[number % len(COLOURS)]
        ordered = sorted(cells, key=lambda cell: float(cell.values[factor]))  # type: ignore[arg-type]
        # Groups stand side by side, trials a little to the left of their mean.
        shift = 0.1 * step * (number - 0.5 * (len(lines) - 1))
        at = [_shifted(float(cell.values[factor]), shift, log) for cell in ordered]  # type: ignore[arg-type]
        found = [judgement.summaries[metric][cell.index] for cell in ordered]
        for x, cell in zip(at, ordered, strict=True):
            dots = column[view.cell == cell.index]
            axes.plot(
                np.full(dots.shape, _shifted(x, -0.06 * step, log)),
                dots,
                ".",
                color=colour,
                alpha=0.25,
                markersize=2.5,
                markeredgewidth=0.0,
            )
        _with_intervals(axes, at, found, colour)
        published = [
            (x, cell.published[metric])
            for x, cell in zip(at, ordered, strict=True)
            if metric in cell.published
        ]
        if published:
            axes.plot(*np.array(published).T, "D", color=ORANGE, markersize=4.0, linestyle="none", zorder=3.0)
    _reference_line(axes, view, metric)


def _with_intervals(axes: Axes, at: Sequence[float], found: Sequence[Summary], colour: str) -> None:
    means = np.array([summary.mean for summary in found])
    low = np.array([summary.low for summary in found])
    high = np.array([summary.high for summary in found])
    bars = np.vstack(
        [means - np.where(np.isfinite(low), low, means), np.where(np.isfinite(high), high, means) - means]
    )
    axes.errorbar(
        at,
        means,
        yerr=np.maximum(bars, 0.0),
        color=colour,
        marker="o",
        markersize=3.5,
        linewidth=1.0,
        elinewidth=1.2,
        capsize=2.0,
        zorder=3.5,
    )


def _settings_panel(axes: Axes, view: StudyView, judgement: Judgement, metric: str, labelled: bool) -> None:
    """One metric in all settings, one row each, the first on top."""
    axes.set_title(metric_of(metric).name + _unit(metric))
    column = view.column(metric)
    count = len(view.cells)
    for cell in view.cells:
        y = count - 1 - cell.index
        trials = column[view.cell == cell.index]
        spread = np.linspace(-0.22, 0.22, trials.size) if trials.size > 1 else np.zeros(trials.size)
        axes.plot(trials, y + spread, ".", color=FAINT, markersize=3.0, markeredgewidth=0.0, alpha=0.7)
        summary = judgement.summaries[metric][cell.index]
        if math.isfinite(summary.mean):
            low = summary.low if math.isfinite(summary.low) else summary.mean
            high = summary.high if math.isfinite(summary.high) else summary.mean
            axes.plot([low, high], [y, y], color=BLUE, linewidth=2.2, solid_capstyle="butt", zorder=3.0)
            axes.plot([summary.mean], [y], "D", color=BLUE, markersize=4.5, zorder=3.5)
        if metric in cell.published:
            axes.plot([cell.published[metric]], [y], "D", color=ORANGE, markersize=4.5, zorder=3.2)
    axes.set_ylim(-0.6, count - 0.4)
    names = [_clipped(cell.name) for cell in reversed(view.cells)] if labelled else [""] * count
    axes.set_yticks(range(count), names)
    axes.margins(x=0.06)


def _lines(view: StudyView, factor: str) -> list[tuple[str, list[Cell]]]:
    """The cells along a numeric factor, one line for each combination of the other factors."""
    groups: dict[tuple[str, ...], list[Cell]] = defaultdict(list)
    for cell in view.cells:
        value = cell.values.get(factor)
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        groups[tuple(f"{view.short(f)} {cell.values.get(f)}" for f in view.factors if f != factor)].append(
            cell
        )
    lines = [
        (", ".join(key), cells) for key, cells in groups.items() if len({c.values[factor] for c in cells}) > 1
    ]
    if len(lines) == 1:
        return [("mean with its 95 % interval", lines[0][1])]
    return lines[: len(COLOURS)]


def _drawable(view: StudyView) -> list[str]:
    """Metrics of which at least one trial gave a value; the one that answers the question first."""
    known = [m for m in view.metrics if bool(np.isfinite(view.column(m)).any())]
    return sorted(known, key=lambda metric: metric != view.primary)


def _shifted(x: float, by: float, log: bool) -> float:
    return x * 10.0**by if log else x + by


def _reference_line(axes: Axes, view: StudyView, metric: str) -> None:
    if metric in view.reference:
        axes.axhline(view.reference[metric][1], color=MUTED, linestyle=(0, (5, 3)), linewidth=1.0, zorder=2.0)


def _clipped(text: str) -> str:
    return text if len(text) <= MAX_LABEL else text[: MAX_LABEL - 1] + "…"


def _unit(metric: str) -> str:
    for ending, unit in (("_m_s", "m/s"), ("_per_s", "1/s"), ("_rad", "rad"), ("_m", "m"), ("_s", "s")):
        if metric.endswith(ending):
            return f" [{unit}]"
    return ""
