"""What the study's figures share: which metrics are drawn, in which unit, on which kind of axis."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from pilotage.evaluation.judge import Judgement
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.table import StudyTable
from pilotage.report import quantities
from pilotage.report.study.scales import Scale, scale_of
from pilotage.report.style import MUTED

MOST = 12
"""So many metrics are drawn, the one that answers the question first; the tables have all."""
FEW_TRIALS = 12
WIDE = 30.0
"""Means that reach over more than this ratio are drawn on a logarithmic axis."""


def dots_of(trials: int) -> dict[str, Any]:
    """How single trials are drawn: a handful to be seen one by one, many as a cloud."""
    few = trials <= FEW_TRIALS
    return {"marker": "o", "markersize": 2.6 if few else 1.5, "markeredgewidth": 0.0, "linestyle": "none"}


def drawable(table: StudyTable, cells: Iterable[Cell]) -> list[str]:
    """Metrics that trials of these cells gave a value of."""
    chosen = list(cells)
    names = dict.fromkeys([table.primary, *table.metrics])
    return [metric for metric in names if table.worth_showing(metric, chosen)][:MOST]


def scale_for(judgement: Judgement, metric: str, cells: Iterable[Cell]) -> Scale:
    """The unit of a panel: that of its means."""
    return scale_of(metric, [judgement.summaries[metric][cell.index].mean for cell in cells])


def title(axes: Axes, metric: str, scale: Scale) -> None:
    """Write the metric and its unit above a panel."""
    axes.set_title(METRICS.find(metric).name + scale.label)


def is_wide(values: Sequence[float], lows: Sequence[float]) -> bool:
    """Whether means belong on a logarithmic axis; what would lie at or below zero keeps it straight."""
    finite = [value for value in values if math.isfinite(value)]
    positive = all(value > 0.0 for value in [*finite, *(low for low in lows if math.isfinite(low))])
    return len(finite) > 1 and positive and max(finite) / min(finite) >= WIDE


def set_log(axes: Axes, which: Literal["x", "y"]) -> None:
    """Turn an axis logarithmic, its ticks written as plain numbers."""
    axis: Axis
    if which == "x":
        axes.set_xscale("log")
        axis = axes.xaxis
    else:
        axes.set_yscale("log")
        axis = axes.yaxis
    axis.set_major_locator(LogLocator(base=10.0, numticks=6))
    axis.set_major_formatter(FuncFormatter(lambda value, _: quantities.significant(value, 1)))
    axis.set_minor_formatter(NullFormatter())


def reference_line(axes: Axes, table: StudyTable, metric: str, scale: Scale, *, upright: bool) -> None:
    """Draw what the metric is held against, where there is such."""
    known = table.study.definition.reference
    if metric not in known:
        return
    at = known[metric].value * scale.times
    draw = axes.axvline if upright else axes.axhline
    draw(at, color=MUTED, linestyle=(0, (5, 3)), linewidth=1.0, zorder=2.0)


def references(table: StudyTable) -> dict[str, str]:
    """By metric, what it is held against in words."""
    known = table.study.definition.reference
    return {metric: f"{entry.name}, {entry.value:g}" for metric, entry in known.items()}
