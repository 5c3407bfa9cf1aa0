"""Walls that lie on one line are found among all lines at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.maps.wall_lines import _first_line, normal_form


def one_by_one(segment: FloatArray, lines: list[tuple[float, float]], tolerance: float) -> int | None:
    """The definition: both ends on the line, to so many metres, and along it, to so many radians."""
    (x0, y0, x1, y1), length = segment, math.hypot(segment[2] - segment[0], segment[3] - segment[1])
    for number, (rho, alpha) in enumerate(lines):
        c, s = math.cos(alpha), math.sin(alpha)
        off = max(abs(x0 * c + y0 * s - rho), abs(x1 * c + y1 * s - rho))
        if off <= tolerance and abs((x1 - x0) * c + (y1 - y0) * s) <= tolerance * length:
            return number
    return None


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_first_that_fits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = np.round(rng.uniform(0.0, 6.0, (200, 2)), seed % 2)
    along = rng.integers(-3, 4, (200, 2)) * rng.choice([0, 1], (200, 2), p=[0.3, 0.7])
    segments = np.column_stack([ends, ends + along])
    segments = segments[np.any(along != 0, axis=1)] + rng.normal(
        0.0, 1e-3, (np.any(along != 0, axis=1).sum(), 4)
    )
    lines = [normal_form(segment) for segment in segments[:60]]
    table = np.array([[math.cos(alpha), math.sin(alpha), rho] for rho, alpha in lines])
    found = [_first_line(segment, table, 2e-3, 2e-3) for segment in segments]
    assert found == [one_by_one(segment, lines, 2e-3) for segment in segments]
    assert sum(number is not None for number in found) >= 60
    assert None in found
