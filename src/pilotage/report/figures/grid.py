"""An occupancy grid under a map: occupied dark, unknown grey, free left blank."""

from __future__ import annotations

import math

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.transforms import Affine2D

from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.occupancy_grid import UNKNOWN, OccupancyGrid

OCCUPIED_COLOUR, UNKNOWN_COLOUR = "#2f3b47", "#d3d9df"
FREE_CELL, UNKNOWN_CELL, OCCUPIED_CELL = 0, 1, 2
"""Classes of cells; free ones are left blank as what lies beyond the grid."""
MOST_PIXELS = 1000
"""A picture is no wider and no higher than this."""
_COLOURS = np.array([(0, 0, 0, 0), (0xD3, 0xD9, 0xDF, 255), (0x2F, 0x3B, 0x47, 255)], dtype=np.uint8)


def cell_classes(grid: OccupancyGrid, most: int = MOST_PIXELS) -> tuple[IntArray, FloatArray]:
    """Classes of a grid's cells for a picture, row 0 at the top, and its (2,) width and height in metres.

    Blocks of cells of a grid of more than ``most`` along a side become one: occupied where one of them is,
    unknown where all are.
    """
    coarse = grid.in_blocks(math.ceil(max(grid.rows, grid.columns) / most))
    classes = np.where(coarse.cells == UNKNOWN, UNKNOWN_CELL, FREE_CELL)
    classes[coarse.blocked(unknown_is_free=True)] = OCCUPIED_CELL
    return classes, np.array([coarse.columns, coarse.rows]) * coarse.resolution_m


def has_unknown(grid: OccupancyGrid | None) -> bool:
    """Whether some cells are unknown."""
    return grid is not None and int(grid.cells.min()) == UNKNOWN


def known_corners(grid: OccupancyGrid) -> FloatArray:
    """(4, 2) corners of the box, along the grid's own axes, around the cells that are known."""
    known = grid.cells != UNKNOWN
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not len(rows):
        rows, columns = np.array([0, grid.rows - 1]), np.array([0, grid.columns - 1])
    x0, x1 = columns[0], columns[-1] + 1
    y0, y1 = grid.rows - 1 - rows[-1], grid.rows - rows[0]
    own = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]) * grid.resolution_m
    return np.asarray(_to_map(grid).transform(own))


def draw_grid(
    axes: Axes, grid: OccupancyGrid, within: tuple[float, float, float, float] | None = None
) -> None:
    """Draw the grid, or only its cells around a window x0, y0, x1, y1, which keeps a page small."""
    shown, corner = (grid, (0.0, 0.0)) if within is None else _cut(grid, within)
    if shown is None:
        return
    classes, (width, height) = cell_classes(shown)
    limits = axes.get_xlim(), axes.get_ylim()
    picture = axes.imshow(
        _COLOURS[classes],
        extent=(corner[0], corner[0] + width, corner[1], corner[1] + height),
        # Without resampling the picture goes into the page as it is.
        interpolation="none",
        transform=_to_map(grid) + axes.transData,
        zorder=0.2,
    )
    picture.set_gid("layer-grid")
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def draw_grown_grid(axes: Axes, grid: OccupancyGrid, by_m: float, colour: str) -> None:
    """Draw what lies within ``by_m`` of occupied or unknown cells."""
    classes, (width, height) = cell_classes(grid)
    cell_m = width / classes.shape[1]
    away_m = cell_m * (scipy.ndimage.distance_transform_edt(classes == FREE_CELL) - 0.5)
    picture = np.zeros((*classes.shape, 4))
    picture[away_m < by_m] = to_rgba(colour)
    limits = axes.get_xlim(), axes.get_ylim()
    drawn = axes.imshow(
        picture,
        extent=(0.0, width, 0.0, height),
        interpolation="none",
        transform=_to_map(grid) + axes.transData,
        zorder=0.1,
    )
    drawn.set_gid("layer-grown")
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _cut(
    grid: OccupancyGrid, within: tuple[float, float, float, float]
) -> tuple[OccupancyGrid | None, tuple[float, float]]:
    """The cells around a window, and their lower left corner in the grid's own frame."""
    x0, y0, x1, y1 = within
    own = _to_map(grid).inverted().transform([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]) / grid.resolution_m
    low = np.maximum(np.floor(own.min(axis=0)).astype(np.int64), 0)
    high = np.minimum(np.ceil(own.max(axis=0)).astype(np.int64), (grid.columns, grid.rows))
    if bool((high <= low).any()):
        return None, (0.0, 0.0)
    part = grid.cells[grid.rows - high[1] : grid.rows - low[1], low[0] : high[0]]
    corner = low * grid.resolution_m
    return OccupancyGrid(part.copy(), grid.resolution_m), (float(corner[0]), float(corner[1]))


def _to_map(grid: OccupancyGrid) -> Affine2D:
    origin = grid.origin
    return Affine2D().rotate(origin.theta_rad).translate(origin.x_m, origin.y_m)
