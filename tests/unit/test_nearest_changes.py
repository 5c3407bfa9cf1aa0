"""The nearest marked cell, kept while cells change: as if it had been worked out anew."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.kernels.grids.distance import NONE, nearest_marked
from pilotage.kernels.grids.nearest_changes import MOST_CHANGED, keep_nearest


@pytest.mark.parametrize("share", [0.002, 0.02, 0.3, 0.95])
@pytest.mark.parametrize("most", [1, 6, 40, 2 * MOST_CHANGED])
def test_it_is_as_if_worked_out_anew(share: float, most: int) -> None:
    """Also where all cells go and come: of those as near always the same one."""
    rng = np.random.default_rng([int(1000 * share), most])
    for _ in range(12):
        rows, columns = rng.integers(1, 60, 2)
        cells = (rng.random((rows, columns)) < share).astype(np.uint8)
        kept = cells.copy()
        rise, nearest = nearest_marked(cells > 0)
        for _ in range(12):
            for row, column in rng.integers(0, (rows, columns), (int(rng.integers(most + 1)), 2)):
                cells[row, column] = 0 if cells[row, column] else rng.integers(1, 60)
            keep_nearest(cells, kept, rise, nearest)
            anew = nearest_marked(cells > 0)
            assert (kept == cells).all()
            assert (rise == anew[0]).all()
            assert (nearest == anew[1]).all()


def test_of_cells_as_near_it_is_the_one_of_the_lowest_column_and_row() -> None:
    cells, kept = np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.uint8)
    rise, nearest = nearest_marked(cells > 0)
    assert (nearest == NONE).all()
    for row, column in ((4, 4), (4, 0), (0, 4), (0, 0)):
        cells[row, column] = 1
        keep_nearest(cells, kept, rise, nearest)
    assert nearest[2, 2] == 0
    assert nearest[2, 3] == 4
    cells[0, 0] = cells[0, 4] = 0
    keep_nearest(cells, kept, rise, nearest)
    assert nearest[2, 2] == 20
