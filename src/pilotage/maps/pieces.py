"""Which of a map's pieces of floor are meant, and which lie outside of what it draws."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from pilotage.core.types import BoolArray, IntArray
from pilotage.maps.world_map import WorldMap

Labels: TypeAlias = npt.NDArray[np.integer]
"""Of cells (rows, columns), from 1 on; 0 is no floor."""
Places: TypeAlias = npt.NDArray[np.floating]
OUTSIDE_RATIO = 1.5
"""Floor along more of the map's edge than so many roots of its own area lies outside."""
LEAST_SHARE = 0.1
"""What is smaller than this share of the largest piece is a shed in a yard rather than a house."""


def meant_piece(pieces: Labels, edge: BoolArray, begun_on: int = 0) -> int:
    """The piece that is meant where nobody says: the largest that lies not outside. 0 where there is none.

    A robot's own map has its origin where it began to drive: the piece that it ``begun_on`` is meant, be it
    small, where it does not lie outside.

    A plan drawn askew or with a margin has floor around its walls as well, often more than between them: it
    runs along the map's edge. A hall or a corridor that the edge cuts off does so for less than
    ``OUTSIDE_RATIO`` times the root of its area. Fails where an open yard is meant that holds a closed house
    of more than ``LEAST_SHARE`` of its size: ``world.start`` tells.
    """
    sizes, lies_outside = _measured(pieces, edge)
    if not sizes.any():
        return 0
    if begun_on and not lies_outside[begun_on]:
        return begun_on
    inside = ~lies_outside & _is_house(sizes)
    return int(np.argmax(np.where(inside, sizes, 0) if inside.any() else sizes))


def outside_of(pieces: Labels, edge: BoolArray, home: int) -> BoolArray:
    """Which cells lie outside for who is in a piece; none for who is outside himself, or in a shed."""
    sizes, lies_outside = _measured(pieces, edge)
    if lies_outside[home] or not _is_house(sizes)[home]:
        return np.zeros(pieces.shape, np.bool_)
    return np.asarray(lies_outside[pieces])


def beside_edge(chart: WorldMap, x_m: Places, y_m: Places, spacing_m: float, clearance_m: float) -> BoolArray:
    """Which cells with middles at y (rows,) and x (columns,) lie along the map's edge, in a single line.

    A grid that is open there has a wall put up around it (``edge.closed``): floor keeps ``clearance_m`` off.
    Open ground goes on beyond its map: none of it is outside.
    """
    if chart.open_ground:
        return np.zeros((len(y_m), len(x_m)), np.bool_)
    xmin, ymin, xmax, ymax = chart.bounds_m
    along, across, reach_m = x_m[None, :] - xmin, y_m[:, None] - ymin, 0.51 * spacing_m
    width_m, height_m = xmax - xmin, ymax - ymin
    grid = chart.grid if chart.geometry is None else None
    if grid is not None:
        c, s = math.cos(grid.origin.theta_rad), math.sin(grid.origin.theta_rad)
        along, across = (x_m - grid.origin.x_m)[None, :], (y_m - grid.origin.y_m)[:, None]
        along, across = c * along + s * across, c * across - s * along
        spanned_m, (width_m, height_m) = width_m, grid.size_m
        if abs(c) * width_m + abs(s) * height_m > spanned_m + 0.5 * grid.resolution_m:
            reach_m = grid.resolution_m + clearance_m + spacing_m
    to_edge = np.minimum(np.minimum(along, width_m - along), np.minimum(across, height_m - across))
    return np.asarray(to_edge <= reach_m)


def _measured(pieces: Labels, edge: BoolArray) -> tuple[IntArray, BoolArray]:
    """How large each piece is, in cells, and whether it lies outside."""
    sizes = np.bincount(pieces.ravel())
    along = np.bincount(pieces[edge], minlength=len(sizes))
    sizes[0] = along[0] = 0
    return sizes, along > OUTSIDE_RATIO * np.sqrt(sizes)


def _is_house(sizes: IntArray) -> BoolArray:
    return np.asarray((sizes > 0) & (sizes >= LEAST_SHARE * sizes.max()))
