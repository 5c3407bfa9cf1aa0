"""What the figures of a sheet share: panels to scale, cells as areas, boxes and tapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline

from pilotage.core.types import BoolArray
from pilotage.records.cells import SheetData
from pilotage.report.figures.layers import line
from pilotage.report.light_axes import LightAxes
from pilotage.report.style import FAINT, GRID, INK, WIDTH_PT, one_shape

_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT, _GAP_PT = 40.0, 8.0, 24.0, 32.0, 44.0
_MOST_HEIGHT_PT = 620.0
MARGIN_SHARE = 0.04
"""Of the sheet's longer side, around it: the body may reach over the edge."""


def sheet_panels(
    sheet: SheetData, titles: Sequence[str], columns: int | None = None
) -> tuple[Figure, list[Axes]]:
    """Panels side by side, so many in a row (None: all), each the whole sheet to scale."""
    columns = len(titles) if columns is None else columns
    rows = -(-len(titles) // columns)
    width, height = sheet.size_m
    margin = MARGIN_SHARE * max(width, height)
    across, up = width + 2.0 * margin, height + 2.0 * margin
    room = (WIDTH_PT - _LEFT_PT - _RIGHT_PT - _GAP_PT * (columns - 1)) / columns
    scale = min(room / across, _MOST_HEIGHT_PT / up)
    high = scale * up
    each = high + _TOP_PT + _BOTTOM_PT
    total = rows * each
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    panels = []
    for index, title in enumerate(titles):
        row, column = divmod(index, columns)
        left = _LEFT_PT + column * (room + _GAP_PT) + 0.5 * (room - scale * across)
        bottom = _BOTTOM_PT + (rows - 1 - row) * each
        place = (left / WIDTH_PT, bottom / total, scale * across / WIDTH_PT, high / total)
        axes = figure.add_axes(place, axes_class=LightAxes)
        axes.set_title(title)
        axes.set_xlim(-margin, width + margin)
        axes.set_ylim(-margin, height + margin)
        axes.set_autoscale_on(False)
        axes.set_xlabel("x [m]", labelpad=2.0)
        axes.set_ylabel("y [m]", labelpad=2.0)
        axes.grid(visible=False)
        axes.tick_params(length=0.0)
        axes.spines[["left", "bottom"]].set_visible(False)
        panels.append(axes)
    return figure, panels


def points_per_m(axes: Axes) -> float:
    """Return a panel's scale on the page."""
    left, right = axes.get_xlim()
    return float(axes.get_position().width) * WIDTH_PT / (right - left)


def fill_cells(
    axes: Axes,
    sheet: SheetData,
    which: BoolArray,
    colour: str,
    layer: str,
    alpha: float = 1.0,
    z: float = 1.0,
) -> None:
    """Fill cells as one shape."""
    rows, columns = sheet.shape
    width, height = sheet.size_m[0] / columns, sheet.size_m[1] / rows
    squares = [
        Outline(
            [
                (column * width, row * height),
                ((column + 1) * width, row * height),
                ((column + 1) * width, (row + 1) * height),
                (column * width, (row + 1) * height),
                (column * width, row * height),
            ],
            closed=True,
        )
        for row, column in np.argwhere(which)
    ]
    one_shape(axes, squares, facecolor=colour, alpha=alpha, zorder=z, gid=f"layer-{layer}")


def draw_grid(axes: Axes, sheet: SheetData) -> None:
    """The cells' edges and the sheet's own."""
    rows, columns = sheet.shape
    width, height = sheet.size_m
    gap = (np.nan, np.nan)
    points: list[tuple[float, float]] = []
    for x in np.linspace(0.0, width, columns + 1):
        points += [(float(x), 0.0), (float(x), height), gap]
    for y in np.linspace(0.0, height, rows + 1):
        points += [(0.0, float(y)), (width, float(y)), gap]
    line(axes, np.array(points), "grid", color=GRID, linewidth=0.5, zorder=0.5)
    edge = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0)])
    line(axes, edge, "edge", color=FAINT, linewidth=1.2, zorder=3.0)


def draw_things(axes: Axes, sheet: SheetData, filled: bool = True) -> None:
    """Boxes, and tapes in their width; as outlines alone where ``filled`` is false."""
    boxes = [
        Outline([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)], closed=True)
        for x0, y0, x1, y1 in sheet.boxes_m
    ]
    look: dict[str, Any] = {"facecolor": "#c5ccd3" if filled else "none", "edgecolor": INK, "linewidth": 0.9}
    one_shape(axes, boxes, zorder=4.0, gid="layer-boxes", **look)
    for tape in sheet.lines_m:
        line(axes, tape, "tapes", color=INK, linewidth=2.6 if filled else 1.0, zorder=4.1)
