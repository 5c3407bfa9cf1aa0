"""The path over the sheet (exploration report, fig. 5), and what was covered when."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pilotage.records.cells import SheetData
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.figures import layers
from pilotage.report.figures.badge import badge
from pilotage.report.figures.event_marks import event_lines, event_places
from pilotage.report.sheet.panels import draw_grid, draw_things, fill_cells, points_per_m, sheet_panels
from pilotage.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    SKY,
    VERMILLION,
    Illustration,
    Key,
    render,
    series,
    stacked_axes,
    time_limits,
)

DONE_SHARE = 0.95
_CELLS = "#d6e9f5"


PATH_KEYS = (
    Key("true path", BLUE, layer="true"),
    Key("where it believed to be", VERMILLION, "dash", layer="estimated"),
    Key("cells truly visited", _CELLS, "band", layer="visited", opacity=1.0),
    Key("start", GREEN, "spot"),
    Key("end", ORANGE, "spot"),
)


def path_figure(run: RunData) -> Illustration:
    """The true path and the believed one over the sheet, with the cells truly visited."""
    slug, title = "sheet-path", "The path over the sheet"
    sheet = run.sheet
    if sheet is None:
        return Illustration(slug, title, "", "The run left no cells.npz.")
    figure, (axes,) = sheet_panels(sheet, [""])
    draw_path(axes, run, sheet)
    trace = run.trace
    for place in event_places(run, points_per_m(axes)):
        badge(axes, place.x_m, place.y_m, place.text, place.colour)
    overhang = trace["overhang_m"]
    over = float(np.nanmax(overhang)) if trace.has("overhang_m") else math.nan
    caption = (
        f"The robot's centre was in {int(sheet.visited.sum())} of {sheet.visited.size} cells. The sheet has "
        "no walls at its edge: a centre that leaves it ends the run."
        + (f" The body reached up to {quantities.length(over)} over the edge." if over > 0.0 else "")
    )
    alt = f"Sheet with boxes and tapes and the true and believed path of the run {run.name}"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), PATH_KEYS)


def draw_path(axes: Axes, run: RunData, sheet: SheetData) -> None:
    """The true path over the cells visited, the believed one, where it began and ended."""
    fill_cells(axes, sheet, sheet.visited, _CELLS, "visited", z=0.3)
    draw_grid(axes, sheet)
    draw_things(axes, sheet)
    layers.line(axes, layers.true_path(run), "true", color=BLUE, linewidth=1.8, zorder=7)
    look: dict[str, Any] = {"color": VERMILLION, "linestyle": (0, (4.0, 2.5)), "zorder": 8}
    layers.line(axes, layers.estimated_path(run), "estimated", linewidth=0.9, **look)
    trace = run.trace
    for index, colour in ((0, GREEN), (-1, ORANGE)):
        if trace.steps:
            x, y, theta = (float(trace[f"true_{axis}"][index]) for axis in ("x_m", "y_m", "theta_rad"))
            layers.draw_body(axes, x, y, theta, sheet.robot_radius_m, colour, opacity=0.6)


def coverage_figure(run: RunData) -> Illustration:
    """Share of all cells and of the reachable ones over time, and the error of the position below."""
    slug, title = "coverage", "Coverage over time"
    sheet, t_s = run.sheet, run.trace.t_s
    if sheet is None or not run.trace.steps:
        return Illustration(slug, title, "", "The run ended before its first step.")
    figure, panels = stacked_axes(["visited [%]", "error of the position [mm]"], (170.0, 80.0))
    time_limits(panels, t_s)
    panels[0].set_ylim(0.0, 100.0)
    reachable = int(sheet.reachable.sum())
    for cells, of, colour in (
        (sheet.visited & sheet.reachable, reachable, BLUE),
        (sheet.visited, sheet.visited.size, SKY),
    ):
        first = np.sort(sheet.first_visit_s[cells])
        if of:
            count = np.searchsorted(first, t_s + 1e-9, side="right")
            series(panels[0], t_s, 100.0 * count / of, colour, linewidth=1.6)
    panels[0].axhline(100.0 * DONE_SHARE, color=MUTED, linewidth=0.8, linestyle=(0, (4.0, 3.0)))
    event_lines(panels[0], run)
    error = 1000.0 * np.hypot(*(layers.estimated_path(run) - layers.true_path(run)).T)
    series(panels[1], t_s, error, INK)
    panels[1].set_ylim(0.0, 1.1 * float(np.nanmax(np.append(error, 1.0))))
    keys = (
        Key("of the reachable cells", BLUE),
        Key("of all cells", SKY),
        Key("95 %", MUTED, "dash"),
    )
    done = number(run.metrics.get("time_to_95_s"))
    caption = (
        f"Reachable are the {reachable} cells in at least a quarter of which the whole body can stand on the "
        "sheet, 15 mm clear of boxes. "
        + (
            f"95 % of them were visited after {quantities.duration(done)}."
            if math.isfinite(done)
            else "The run never visited 95 % of them."
        )
        + " Thin lines are the events of the list below."
    )
    alt = "Share of visited cells over time, and the error of the estimated position"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)
