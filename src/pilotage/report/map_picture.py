"""A picture of a map as it was understood: walls, cells, heights, markings, landmarks, bounds."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import Affine2D

from pilotage.core.shown import visible
from pilotage.core.types import FloatArray
from pilotage.core.whole_file import draft_of
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.occupancy_grid import OCCUPIED_FROM, OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.report.style import BLUE, FAINT, GREEN, INK, ORANGE, drawing_style

FREE_COLOUR, OCCUPIED_COLOUR, UNKNOWN_COLOUR = "#ffffff", "#39434d", "#c9d1d9"
MOST_PIXELS = 2000
"""Cells along a side that are drawn; of a finer grid every second, third, ... cell."""
LABEL_SHARE = 0.012
"""Landmarks closer than this share of the map's longer side have one label: that is how high a number is."""
MOST_NUMBERS = 3
"""Numbers in a label before it only says how many more there are."""


def draw_map(chart: WorldMap, path: Path) -> None:
    """Write a PNG picture; a file of that name is replaced in one go."""
    xmin, ymin, xmax, ymax = chart.bounds_m
    width, height = xmax - xmin, ymax - ymin
    side = 8.0 / max(width, height)
    with drawing_style():
        figure = Figure(figsize=(max(width * side, 3.0) + 1.2, max(height * side, 2.0) + 1.2), layout="tight")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        _draw_cells(axes, chart)
        _draw_geometry(axes, chart)
        axes.add_patch(Rectangle((xmin, ymin), width, height, fill=False, edgecolor=FAINT, linestyle="--"))
        if len(chart.landmarks):
            _draw_landmarks(axes, chart)
        margin = 0.03 * max(width, height)
        axes.set_xlim(xmin - margin, xmax + margin)
        axes.set_ylim(ymin - margin, ymax + margin)
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
        axes.set_title(f"{visible(chart.name)}: {width:g} m x {height:g} m")
        with draft_of(path) as draft:
            figure.savefig(draft, dpi=110, format="png")


def _draw_cells(axes: Axes, chart: WorldMap) -> None:
    """Heights as colours where there are any, cells above them."""
    grid = chart.grid
    if grid is None:
        return
    step = max(1, -(-max(grid.cells.shape) // MOST_PIXELS))
    if chart.elevation is not None:
        heights = chart.elevation.elevation_m[::step, ::step]
        _placed(axes, grid, np.asarray(heights, dtype=np.float64), "terrain", None, 0.6)
    kinds = np.where(grid.cells < 0, 2.0, np.where(grid.cells >= OCCUPIED_FROM, 1.0, 0.0))[::step, ::step]
    if chart.elevation is not None:
        kinds = np.where(kinds == 0.0, np.nan, kinds)
    colours = ListedColormap([FREE_COLOUR, OCCUPIED_COLOUR, UNKNOWN_COLOUR])
    _placed(axes, grid, kinds, colours, (0.0, 2.0), 1.0)


def _placed(
    axes: Axes,
    grid: OccupancyGrid,
    values: FloatArray,
    colours: str | ListedColormap,
    limits: tuple[float, float] | None,
    zorder: float,
) -> None:
    """Draw an array where the grid lies, turned as the grid is."""
    width, height = grid.size_m
    low, high = limits if limits is not None else (None, None)
    image = axes.imshow(
        values,
        cmap=colours,
        vmin=low,
        vmax=high,
        extent=(0.0, width, 0.0, height),
        origin="upper",
        interpolation="nearest",
        zorder=zorder,
    )
    turn = Affine2D().rotate(grid.origin.theta_rad).translate(grid.origin.x_m, grid.origin.y_m)
    image.set_transform(turn + axes.transData)


def _draw_geometry(axes: Axes, chart: WorldMap) -> None:
    if chart.geometry is not None:
        walls = chart.geometry.segments_m.reshape(-1, 2, 2)
        axes.add_collection(LineCollection(list(walls), colors=INK, linewidths=1.4, zorder=3.0))
        for x, y, radius in chart.geometry.circles_m:
            axes.add_patch(Circle((x, y), radius, facecolor=FAINT, edgecolor=INK, zorder=2.9))
    if chart.markings is not None:
        tapes = chart.markings.tapes_m.reshape(-1, 2, 2)
        axes.add_collection(LineCollection(list(tapes), colors=ORANGE, linewidths=2.0, zorder=2.0))


def _draw_landmarks(axes: Axes, chart: WorldMap) -> None:
    points = chart.landmarks.points_xy_m
    axes.plot(points[:, 0], points[:, 1], "o", color=GREEN, markersize=4.0, zorder=4.0)
    xmin, ymin, xmax, ymax = chart.bounds_m
    for (x, y), label in landmark_labels(chart.landmarks, LABEL_SHARE * max(xmax - xmin, ymax - ymin)):
        axes.annotate(label, (x, y), (3, 3), textcoords="offset points", fontsize=7, color=BLUE, zorder=4.1)


def landmark_labels(landmarks: Landmarks, apart_m: float) -> list[tuple[tuple[float, float], str]]:
    """One label for landmarks closer than ``apart_m``, whose numbers would cover each other: ``3, 17``."""
    labels: list[tuple[tuple[float, float], list[int]]] = []
    for number, (x, y) in zip(landmarks.ids, landmarks.points_xy_m, strict=True):
        for at, numbers in labels:
            if math.hypot(x - at[0], y - at[1]) < apart_m:
                numbers.append(int(number))
                break
        else:
            labels.append(((float(x), float(y)), [int(number)]))
    return [(at, _numbers(numbers)) for at, numbers in labels]


def _numbers(numbers: list[int]) -> str:
    shown = ", ".join(str(number) for number in numbers[:MOST_NUMBERS])
    more = len(numbers) - MOST_NUMBERS
    return shown if more <= 0 else f"{shown} and {more} more"
