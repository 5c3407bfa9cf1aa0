"""Passages whose middle lies between two rows of a floor's cells."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.geometry.plane import distances_to_nearest

STEEP = 0.5
"""Of a cell's side: by so much distances to walls rise and fall from cell to cell across a passage."""


def beside_middles(
    clearance_m: FloatArray,
    first_xy_m: tuple[float, float],
    cell_m: float,
    radius_m: float,
    walls: tuple[FloatArray, FloatArray],
) -> BoolArray:
    """(rows, columns) cells without room for a radius, on both sides of a passage's middle that has it.

    Parameters
    ----------
    clearance_m
        (rows, columns) exact distances to walls, which are lines; negative where it is solid.
    first_xy_m
        Middle of the cell in the first row and column.
    walls
        Segments (N, 4) and circles (M, 3).
    """
    beside = np.zeros(clearance_m.shape, np.bool_)
    for axis in (0, 1):
        across, marked = np.moveaxis(clearance_m, axis, 0), np.moveaxis(beside, axis, 0)
        before, one, other, after = across[:-3], across[1:-2], across[2:-1], across[3:]
        peak = np.minimum(one - before, other - after) >= STEEP * cell_m
        near = (np.maximum(one, other) < radius_m) & (one + other + cell_m >= 2.0 * radius_m)
        step, line = np.nonzero(peak & near)
        # As far from the wall behind the one as from that behind the other.
        at = step + 1.5 + 0.5 * (other - one)[step, line] / cell_m
        points = np.stack([at, line] if axis else [line, at], axis=1) * cell_m + first_xy_m
        wide = distances_to_nearest(points, *walls) >= radius_m
        marked[step[wide] + 1, line[wide]] = marked[step[wide] + 2, line[wide]] = True
    return beside
