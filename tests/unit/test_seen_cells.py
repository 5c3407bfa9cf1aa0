"""Cells that a scanner has in view: passed over by sectors, they are those that the beams themselves say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.scans.seen_cells import mark_seen


def by_beams(cells: FloatArray, first: float, step: float, ranges: FloatArray, half_m: float) -> BoolArray:
    """Each cell from (0, 0) by the beam that is nearest to its direction."""
    seen = np.zeros(len(cells), dtype=np.bool_)
    for k, (x, y) in enumerate(cells):
        away, turn = math.sqrt(x * x + y * y), (math.atan2(y, x) - first) % (2.0 * math.pi)
        beam = round(turn / step)
        if beam >= len(ranges):
            beam = 0 if 2.0 * math.pi - turn < 0.5 * step else -1
        seen[k] = away <= half_m or (beam >= 0 and away <= ranges[beam] + half_m)
    return np.asarray(seen & (np.hypot(*cells.T) <= 8.0))


@pytest.mark.parametrize("beams", [1, 7, 90, 240, 1081])
@pytest.mark.parametrize("fan_rad", [2.0 * math.pi, 1.5 * math.pi, 0.3])
@pytest.mark.parametrize("first", [-3.0, 0.4, 5.0])
def test_sectors_change_nothing(beams: int, fan_rad: float, first: float) -> None:
    """Also where the fan does not close, between beams that differ, and for one beam alone."""
    rng = np.random.default_rng(beams)
    full = fan_rad > 6.2
    step = max(fan_rad / (beams if full else max(beams - 1, 1)), 1e-9) if beams > 1 else 1e-9
    ranges = rng.uniform(0.0, 8.0, beams) * rng.integers(0, 2, beams)
    grid = np.arange(-8.0, 8.1, 0.5)
    cells = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    seen_s = np.zeros(len(cells))
    mark_seen(seen_s, cells, 0.0, 0.0, first, step, ranges, 8.0, 0.35, 5.0)
    assert np.array_equal(seen_s == 5.0, by_beams(cells, first, step, ranges, 0.35))
    assert (seen_s == 5.0).any()
    assert not (seen_s == 5.0).all()
