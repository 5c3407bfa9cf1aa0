"""What happened and when: the numbered events over the path still to go, and the modes below."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path as Outline

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report.event_kinds import event_kind
from pilotage.report.figures.badge import RADIUS_PT, badge
from pilotage.report.figures.event_marks import event_lines
from pilotage.report.modes import MODES, Mode, mode_spans
from pilotage.report.style import (
    BLUE,
    GRID,
    Illustration,
    Key,
    nice_limit,
    note,
    one_shape,
    peak,
    render,
    series,
    stacked_axes,
    time_limits,
)

SLUG = "timeline"
TITLE = "What happened and when"
MOST_ROWS = 6
_ROW_PT = 2.0 * RADIUS_PT + 3.0
_MODE_PT = 13.0
_WIDTH_PT = 660.0


def timeline_figure(run: RunData) -> Illustration:
    """Draw the numbered events, the distance to go and a strip a mode over time."""
    trace, t_s = run.trace, run.trace.t_s
    to_go_known = trace.has("distance_to_go_m")
    if not trace.steps or trace.has("path_x_m"):
        return Illustration(SLUG, TITLE, "", "The run ended before its first step.")
    rows = _badge_rows(run)
    used = [(mode, stretches) for mode in MODES if len(stretches := mode_spans(trace, mode))]
    if not (rows or used or to_go_known):
        return Illustration(SLUG, TITLE, "", "The run recorded neither events nor modes.")
    titles, heights = ["Events, numbered as in the list"], [max(1, 1 + max(rows, default=0)) * _ROW_PT]
    if to_go_known:
        titles.append("Distance to go [m]")
        heights.append(85.0)
    if used:
        titles.append("Mode")
        heights.append(len(used) * _MODE_PT)
    figure, panels = stacked_axes(titles, heights)
    time_limits(panels, t_s)
    _events(panels[0], panels[1] if to_go_known else panels[0], run, rows)
    if to_go_known:
        to_go = trace["distance_to_go_m"]
        panels[1].set_ylim(0.0, nice_limit(peak(to_go)))
        series(panels[1], t_s, to_go, BLUE, linewidth=1.4)
    if used:
        _modes(panels[-1], used)
    dt_s = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.1
    spent = [
        f"{mode.name} {float(np.sum(trace['mode'] == mode.number)) * dt_s:.1f}\u00a0s" for mode, _ in used
    ]
    caption = (
        "Each number is an event of the list below"
        + ("; thin lines carry it down to the way that was still to go." if to_go_known else ".")
        + (f" Time spent: {', '.join(spent)}." if spent else "")
    )
    keys = tuple(Key(mode.name, mode.colour, "band", opacity=1.0) for mode, _ in used)
    alt = "Timeline of the run: numbered events, the distance to go and the robot's modes"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _badge_rows(run: RunData) -> list[int]:
    """Give each event a row such that badges do not touch; -1 where there is no row left."""
    t_s = run.trace.t_s
    span_s = max(float(t_s[-1] - t_s[0]), 1e-9) if len(t_s) > 1 else 1.0
    needed_s = span_s * (2.0 * RADIUS_PT + 3.0) / _WIDTH_PT
    free_from = [-np.inf] * MOST_ROWS
    rows = []
    for event in run.events:
        time = event.t_s if np.isfinite(event.t_s) else 0.0
        row = next((index for index, free in enumerate(free_from) if free <= time), -1)
        if row >= 0:
            free_from[row] = time + needed_s
        rows.append(row)
    return rows


def _events(axes: Axes, below: Axes, run: RunData, rows: list[int]) -> None:
    axes.set_ylim(1.0 + max(rows, default=0), 0.0)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    if not run.events:
        note(axes, "nothing out of the ordinary")
    event_lines(below, run)
    for index, (event, row) in enumerate(zip(run.events, rows, strict=True), start=1):
        if row >= 0 and np.isfinite(event.t_s):
            badge(axes, event.t_s, row + 0.5, str(index), event_kind(event.kind).colour)


def _modes(axes: Axes, used: list[tuple[Mode, FloatArray]]) -> None:
    axes.set_ylim(len(used), 0.0)
    axes.set_yticks([index + 0.5 for index in range(len(used))], [mode.short for mode, _ in used])
    axes.grid(visible=False, axis="y")
    for index, (mode, stretches) in enumerate(used):
        axes.axhline(index + 0.5, color=GRID, linewidth=0.8, zorder=0.3)
        low, high = index + 0.18, index + 0.82
        boxes = [
            Outline([(a, low), (b, low), (b, high), (a, high), (a, low)], closed=True) for a, b in stretches
        ]
        one_shape(axes, boxes, facecolor=mode.colour, edgecolor=mode.colour, linewidth=0.8)
