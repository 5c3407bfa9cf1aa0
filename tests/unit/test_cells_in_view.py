"""Cells in view of each other on a grid, against the line looked at with NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.grids.view import first_in_view, is_in_view

CELL = st.tuples(st.integers(0, 11), st.integers(0, 17))


@settings(max_examples=300, deadline=None)
@given(CELL, CELL, st.integers(0, 1000), st.floats(0.0, 0.4))
def test_a_cell_is_in_view_where_the_line_meets_nothing_solid(
    one: tuple[int, int], other: tuple[int, int], seed: int, share: float
) -> None:
    solid = np.random.default_rng(seed).random((12, 18)) < share
    count = 2 * max(abs(one[0] - other[0]), abs(one[1] - other[1])) + 1
    rows, columns = (np.rint(np.linspace(one[k], other[k], count)).astype(int) for k in range(2))
    assert is_in_view(solid, *one, *other) == (not solid[rows, columns].any())


def test_the_first_cell_in_view_is_taken() -> None:
    solid = np.zeros((5, 9), np.bool_)
    solid[:4, 4] = True
    rows, columns = np.array([0, 3, 4, 0]), np.array([0, 0, 8, 8])
    assert first_in_view(solid, rows, columns, 0, 6) == 2
    solid[4, 4] = True
    assert first_in_view(solid, rows[:2], columns[:2], 0, 6) == -1
