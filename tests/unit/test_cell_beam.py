"""What a beam marks on a sheet, against a look at every point of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pilotage.kernels.sheet.cell_beam import EXPLORED, OBSTACLE, mark_beam

CELL, STEP = 0.2, 0.05


def marked(
    x: float, y: float, mx: float, my: float, theta: float, length: float, sees: bool
) -> NDArray[np.uint8]:
    states = np.full((8, 10), 6, dtype=np.uint8)
    mark_beam(states, x, y, mx, my, theta, length, sees, CELL, CELL, STEP, 0)
    return states


@pytest.mark.parametrize("seed", range(40))
def test_a_beam_explores_the_cells_of_its_points_that_are_on_the_sheet(seed: int) -> None:
    rng = np.random.default_rng([1811, seed])
    x, y = rng.uniform(-1.0, 3.0, 2)
    dx, dy = (0.0, 0.0) if seed % 4 == 0 else rng.uniform(-1.5, 1.5, 2)
    mx, my = x + dx, y + dy
    theta = 0.5 * math.pi * (seed // 8) if seed % 3 == 0 else rng.uniform(-math.pi, math.pi)
    length = rng.uniform(0.0, 4.0)
    under = math.hypot(mx - x, my - y)
    points = [
        (x + k * STEP / under * (mx - x), y + k * STEP / under * (my - y))
        for k in range(math.ceil(under / STEP))
    ]
    points += [
        (mx + k * STEP * math.cos(theta), my + k * STEP * math.sin(theta))
        for k in range(math.ceil(length / STEP))
    ]
    wanted = np.full((8, 10), 6, dtype=np.uint8)
    for px, py in points:
        row, column = math.floor(py / CELL), math.floor(px / CELL)
        if 0 <= row < 8 and 0 <= column < 10:
            wanted[row, column] = EXPLORED
    np.testing.assert_array_equal(marked(x, y, mx, my, theta, length, sees=False), wanted)


def test_a_sensor_far_beyond_the_sheet_is_not_followed_there() -> None:
    """A mission whose sensor sat a million kilometres beside the robot did not come back for half an hour."""
    states = marked(1.0, 0.8, 1.0, 1e15, 0.0, 1e15, sees=True)
    np.testing.assert_array_equal(states[4:, 5], EXPLORED)
    assert not (states == OBSTACLE).any()
