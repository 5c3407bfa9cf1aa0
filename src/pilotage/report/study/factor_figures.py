"""Each metric over each numeric factor, with intervals."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import Summary
from pilotage.evaluation.judge import Judgement
from pilotage.evaluation.metric import words_and_unit
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.groups import CellGroup
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.light_axes import LightAxes
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
from pilotage.report.style import (
    BLUE,
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
CROWDED = 0.02
"""Values nearer to each other than this share of their range stand evenly apart instead."""
MOST_TICKS = 12

Line = tuple[str, list[Cell]]


def factor_figures(table: StudyTable, judgement: Judgement) -> list[Illustration]:
    """One figure a group and numeric factor, one panel a metric."""
    out = []
    for number, group in enumerate(table.groups, start=1):
        for factor in table.factors:
            lines = lines_over(table, table.members(group), factor)
            if lines:
                out.append(_factor_figure(table, judgement, group, number, factor, lines))
    return out


def lines_over(table: StudyTable, cells: Sequence[Cell], factor: str) -> list[Line]:
    """The cells along a numeric factor, one line for each combination of the other factors."""
    numeric = [cell for cell in cells if _is_number(cell.values.get(factor))]
    others = [f for f in table.factors if f != factor]
    if any(_is_number(cell.values.get(f)) for f in others for cell in numeric):
        # What a named configuration amounts to is in its values; its name would set every cell apart.
        named = {f for f in others if len({str(c.values.get(f)) for c in numeric}) == len(numeric)}
        others = [f for f in others if f not in named or _is_number(numeric[0].values.get(f))]
    groups: dict[tuple[object, ...], list[Cell]] = defaultdict(list)
    for cell in numeric:
        groups[tuple(_kept_apart(cell.values.get(f)) for f in others)].append(cell)
    kept = {key: line for key, line in groups.items() if len({c.values[factor] for c in line}) > 1}
    kept = dict(sorted(kept.items(), key=lambda entry: [v if _is_number(v) else 0.0 for v in entry[0]]))
    differing = [i for i in range(len(others)) if len({key[i] for key in kept}) > 1]
    if len(kept) == 1:
        return [("mean with its 95 % interval", next(iter(kept.values())))]
    names = [
        ", ".join(_said(table, others[i], line[0].values.get(others[i])) for i in differing)
        for line in kept.values()
    ]
    return list(zip(names, kept.values(), strict=True))[: len(COLOURS)]


def _kept_apart(value: object) -> float | str:
    """What tells a line's values from another's: numbers, and texts for all else, lists and mappings too."""
    return value if isinstance(value, int | float) and _is_number(value) else str(value)


def _said(table: StudyTable, factor: str, value: object) -> str:
    """A factor's value with its name and its unit; a level or a configuration by its own name."""
    if not _is_number(value):
        said = table.study.definition.said(factor, value)
        return said if isinstance(value, str) else f"{words_and_unit(factor)[0]} {said}"
    unit = table.unit(factor)
    return f"{words_and_unit(factor)[0]} {value:g}{f' {unit}' if unit else ''}"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _factor_figure(
    table: StudyTable,
    judgement: Judgement,
    group: CellGroup,
    number: int,
    factor: str,
    lines: Sequence[Line],
) -> Illustration:
    metrics = drawable(table, [cell for _, cells in lines for cell in cells])
    rows = math.ceil(len(metrics) / PANELS_ACROSS)
    total = TOP_PT + rows * PANEL_PT + (rows - 1) * GAP_Y_PT + BOTTOM_PT
    width = (WIDTH_PT - LEFT_PT - RIGHT_PT - GAP_X_PT * (PANELS_ACROSS - 1)) / PANELS_ACROSS
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    for place, metric in enumerate(metrics):
        line, across = divmod(place, PANELS_ACROSS)
        left = LEFT_PT + across * (width + GAP_X_PT)
        bottom = total - TOP_PT - PANEL_PT - line * (PANEL_PT + GAP_Y_PT)
        axes = figure.add_axes(
            (left / WIDTH_PT, bottom / total, width / WIDTH_PT, PANEL_PT / total), axes_class=LightAxes
        )
        _factor_panel(axes, table, judgement, factor, metric, lines)
    keys = [Key(label, COLOURS[i % len(COLOURS)]) for i, (label, _) in enumerate(lines)]
    if any(metric in cell.published for _, cells in lines for cell in cells for metric in metrics):
        keys.append(Key("published", ORANGE, "spot"))
    keys += [Key(text, MUTED, "dash") for metric, text in references(table).items() if metric in metrics]
    alone = len(table.groups) == 1 or group.name == factor
    slug = f"factor-{'' if alone else f'{number}-'}{''.join(c if c.isalnum() else '-' for c in factor)}"
    short = words_and_unit(factor)[0]
    alt = f"The study's metrics over {short}: means with 95 % intervals."
    beside = ", side by side about it" if len(lines) > 1 else ""
    caption = (
        f"Means over the trials at each {short}{beside}, with 95 % bootstrap intervals; small dots are "
        "single trials."
    )
    name = f"Over {short}" if alone else f"Over {short}: {group.name}"
    return Illustration(slug, name, alt, caption, render(figure, slug, alt), tuple(keys))


def _factor_panel(
    axes: Axes, table: StudyTable, judgement: Judgement, factor: str, metric: str, lines: Sequence[Line]
) -> None:
    """One metric over one factor."""
    everything = [cell for _, cells in lines for cell in cells]
    scale = scale_for(judgement, metric, everything)
    title(axes, metric, scale)
    unit = table.unit(factor)
    axes.set_xlabel(words_and_unit(factor)[0] + (f" [{unit}]" if unit else ""), labelpad=3.0)
    found = [judgement.summaries[metric][cell.index] for cell in everything]
    if is_wide([summary.mean for summary in found], [summary.smallest for summary in found]):
        set_log(axes, "y")
    places = _Places([_value(cell, factor) for cell in everything])
    places.prepare(axes)
    column = table.column(metric) * scale.times
    for number, (_, cells) in enumerate(lines):
        colour = COLOURS[number % len(COLOURS)]
        ordered = sorted(cells, key=lambda cell: _value(cell, factor))
        # Groups stand side by side, trials a little to the left of their mean.
        aside = 0.1 * (number - 0.5 * (len(lines) - 1))
        at = [places.of(_value(cell, factor), aside) for cell in ordered]
        for cell in ordered:
            dots = column[table.cell == cell.index]
            x = places.of(_value(cell, factor), aside - 0.06)
            axes.plot(
                np.full(dots.shape, x),
                dots,
                color=colour,
                alpha=0.45,
                **dots_of(dots.size),
            )
        _with_intervals(
            axes, at, [judgement.summaries[metric][c.index] for c in ordered], colour, scale.times
        )
        published = [
            (x, cell.published[metric] * scale.times)
            for x, cell in zip(at, ordered, strict=True)
            if metric in cell.published
        ]
        if published:
            axes.plot(*np.array(published).T, "D", color=ORANGE, markersize=4.0, linestyle="none", zorder=3.0)
    reference_line(axes, table, metric, scale, upright=False)


def _value(cell: Cell, factor: str) -> float:
    return float(cell.values[factor])


class _Places:
    """Where a factor's values stand on the axis: straight, logarithmic, or evenly where they crowd."""

    def __init__(self, values: Sequence[float]) -> None:
        self._values = sorted(set(values))
        first, last = self._values[0], self._values[-1]
        gap = min(float(step) for step in np.diff(self._values))
        self._log = len(self._values) > 2 and first > 0.0 and last / first >= 30.0
        self._even = not self._log and gap < CROWDED * (last - first)
        # Ticks elsewhere would tell what stands aside of its value to be another value's.
        self._has_room = (
            len(self._values) <= MOST_TICKS if self._log else gap * MOST_TICKS >= 0.999 * (last - first)
        )
        # The least step: aside of its value nothing stands nearer to another one.
        places = np.log10(self._values) if self._log else np.array(self._values)
        self._step = 1.0 if self._even else float(np.diff(places).min())

    def prepare(self, axes: Axes) -> None:
        """Give the axis its scale, its ends and its ticks; settings without a trial keep their place."""
        if self._log:
            set_log(axes, "x")
        axes.set_xlim(self.of(self._values[0], -0.4), self.of(self._values[-1], 0.4))
        if self._even or self._has_room:
            at = [self.of(value, 0.0) for value in self._values]
            axes.set_xticks(at, [f"{value:g}" for value in self._values])
            axes.xaxis.set_minor_locator(NullLocator())

    def of(self, value: float, aside: float) -> float:
        """The place of a value, so many steps aside."""
        if self._even:
            return self._values.index(value) + aside
        return value * 10.0 ** (aside * self._step) if self._log else value + aside * self._step


def _with_intervals(
    axes: Axes, at: Sequence[float], found: Sequence[Summary], colour: str, times: float
) -> None:
    means, low, high = (
        times * np.array([getattr(summary, name) for summary in found]) for name in ("mean", "low", "high")
    )
    bars: FloatArray = np.vstack(
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
