"""What one infrared beam says of a cell map: explored before the return, an obstacle at it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.jit import kernel

States = NDArray[np.uint8]

OBSTACLE, BORDER, EXPLORED = np.uint8(0), np.uint8(2), np.uint8(5)
"""The values of ``maps.cell_map.CellState`` that a beam writes; the smaller one wins."""


@kernel
def mark(states: States, row: int, column: int, state: np.uint8, margin: int) -> None:
    """Write a state where nothing of higher priority stands; but for features, ``margin`` outer cells are
    left alone, as though they were a border."""
    rows, columns = states.shape
    if state < BORDER:
        margin = 0
    if margin <= row < rows - margin and margin <= column < columns - margin:
        states[row, column] = min(states[row, column], state)


@kernel
def mark_obstacle(states: States, row: int, column: int, margin: int) -> None:
    """Write an obstacle and the border around it."""
    mark(states, row, column, OBSTACLE, margin)
    if 0 <= row < states.shape[0] and 0 <= column < states.shape[1]:
        for i in range(-1, 2):
            for j in range(-1, 2):
                mark(states, row + i, column + j, BORDER, margin)


@kernel
def _on_sheet(
    x: float, y: float, step_x: float, step_y: float, count: int, width: float, height: float
) -> tuple[int, int]:
    """The k from 0 to below ``count`` of which (x + k step_x, y + k step_y) may lie on a sheet: first, end.

    A sensor far beyond the sheet would be followed there point by point.
    """
    low, high = 0.0, float(count)
    for at, by, most in ((x, step_x, width), (y, step_y, height)):
        if by == 0.0:
            if at < 0.0 or at > most:
                return 0, 0
            continue
        first, last = min(-at / by, (most - at) / by) - 1.0, max(-at / by, (most - at) / by) + 2.0
        if first > low:
            low = first
        if last < high:
            high = last
    return (int(low), math.ceil(high)) if low < high else (0, 0)


@kernel
def mark_beam(
    states: States,
    x: float,
    y: float,
    mount_x: float,
    mount_y: float,
    theta: float,
    length: float,
    sees: bool,
    cell_width: float,
    cell_height: float,
    step: float,
    margin: int,
) -> None:
    """Mark what a beam passes EXPLORED and, where it ``sees`` something, its end OBSTACLE, in place.

    Parameters
    ----------
    states
        (rows, columns), row 0 at y = 0.
    x, y
        The body's centre; the stretch from there to the sensor is under the body.
    mount_x, mount_y
        Where the beam begins on the map.
    theta, length
        Its direction on the map and how far it is believed.
    step
        Spacing of the points looked at.
    """
    end_row = math.floor((mount_y + length * math.sin(theta)) / cell_height)
    end_column = math.floor((mount_x + length * math.cos(theta)) / cell_width)
    width, height = states.shape[1] * cell_width, states.shape[0] * cell_height
    under = math.hypot(mount_x - x, mount_y - y)
    along_x, along_y = step / under * (mount_x - x), step / under * (mount_y - y)
    begin, end = _on_sheet(x, y, along_x, along_y, math.ceil(under / step), width, height)
    for k in range(begin, end):
        px, py = x + k * step / under * (mount_x - x), y + k * step / under * (mount_y - y)
        mark(states, math.floor(py / cell_height), math.floor(px / cell_width), EXPLORED, margin)
    along_x, along_y = step * math.cos(theta), step * math.sin(theta)
    begin, end = _on_sheet(mount_x, mount_y, along_x, along_y, math.ceil(length / step), width, height)
    for k in range(begin, end):
        px, py = mount_x + k * step * math.cos(theta), mount_y + k * step * math.sin(theta)
        row, column = math.floor(py / cell_height), math.floor(px / cell_width)
        if not (sees and row == end_row and column == end_column):
            mark(states, row, column, EXPLORED, margin)
    if sees:
        mark_obstacle(states, end_row, end_column, margin)
