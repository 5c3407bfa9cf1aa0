"""The time to go over a floor, the way down it, and around discs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.control import eikonal


def lowered(time: FloatArray, slowness: FloatArray, spacing: float) -> None:
    """The same as ``sweep_down``, every node looked at in every sweep."""
    rows, columns = time.shape
    padded = np.pad(time, 1, constant_values=np.inf)
    changed = np.inf
    while changed > eikonal.NEAR_S:
        changed = 0.0
        for down, right in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            for r in range(rows)[::down]:
                for c in range(columns)[::right]:
                    cost = slowness[r, c] * spacing
                    a = min(padded[r, c + 1], padded[r + 2, c + 1])
                    b = min(padded[r + 1, c], padded[r + 1, c + 2])
                    if not (np.isfinite(cost) and min(a, b) < np.inf):
                        continue
                    new = min(a, b) + cost
                    if abs(a - b) < cost:
                        new = 0.5 * (a + b + math.sqrt(2.0 * cost * cost - (a - b) * (a - b)))
                    if new < padded[r + 1, c + 1] - 1e-12:
                        changed = max(changed, padded[r + 1, c + 1] - new)
                        padded[r + 1, c + 1] = new
    time[:] = padded[1:-1, 1:-1]


class TestTimeToGo:
    def test_on_open_floor_it_is_the_distance_in_every_direction(self) -> None:
        time = np.full((81, 81), np.inf)
        time[40, 40] = 0.0
        eikonal.sweep_down(time, np.full(time.shape, 2.0), 0.1)
        rows, columns = np.mgrid[:81, :81]
        exact = 0.2 * np.hypot(rows - 40, columns - 40)
        # First order, from above; steps between neighbouring cells would be off by 8 %.
        assert (time >= exact - 1e-9).all()
        assert (time - exact <= 0.05 * exact + 0.1).all()
        assert (time - exact)[exact > 8.0].max() <= 0.04 * 8.0

    def test_it_leads_around_a_wall(self) -> None:
        slowness = np.ones((41, 41))
        slowness[:36, 20] = np.inf
        time = np.full((41, 41), np.inf)
        time[5, 35] = 0.0
        eikonal.sweep_down(time, slowness, 0.1)
        around = math.hypot(1.5, 3.1) + math.hypot(1.5, 3.1)
        assert time[5, 5] == pytest.approx(around, rel=0.06)
        _, dy = eikonal.descent(1.5, 1.5, (time, 0.0, 0.0, 0.1))
        assert dy > 0.7

    def test_nodes_left_alone_are_those_that_would_not_change(self) -> None:
        """Lowered as long as anything changes, all of them each time: not a bit differs."""
        rng = np.random.default_rng(3)
        for _ in range(6):
            slow = np.where(rng.random((9, 12)) < 0.2, np.inf, rng.uniform(0.5, 3.0, (9, 12)))
            time = np.full(slow.shape, np.inf)
            time[rng.integers(9, size=3), rng.integers(12, size=3)] = rng.uniform(0.0, 2.0, 3)
            again = time.copy()
            eikonal.sweep_down(time, slow, 0.15)
            lowered(again, slow, 0.15)
            assert np.array_equal(again, time)

    def test_a_way_ends_at_its_goal(self) -> None:
        """It went to and fro over it until all its steps were made: claims ended there, with 90 turns."""
        time = np.full((21, 61), np.inf)
        time[10, 50] = 0.0
        eikonal.sweep_down(time, np.full(time.shape, 1.0), 0.15)
        for x in np.arange(0.6, 3.0, 0.1):
            way = eikonal.way_down(x, 1.57, (time, 0.0, 0.0, 0.15), time, 0.25, 100)
            length_m = float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum())
            assert np.hypot(way[-1, 0] - 7.5, way[-1, 1] - 1.5) <= 0.2
            assert length_m <= 7.5 - x + 0.25
        assert len(eikonal.way_down(0.6, 1.57, (time, 0.0, 0.0, 0.15), time, 0.25, 8)) == 9

    def test_a_way_does_not_turn_back_at_its_goal(self) -> None:
        """Its last steps went to and fro, and mates who followed one took it for coming against them."""
        time = np.full((21, 61), np.inf)
        time[10, 50] = 0.0
        eikonal.sweep_down(time, np.full(time.shape, 1.0), 0.15)
        for x in np.arange(0.6, 7.0, 0.1):
            for y in (1.2, 1.57, 2.2):
                legs = np.diff(eikonal.way_down(x, y, (time, 0.0, 0.0, 0.15), time, 0.25, 100)[:, :2], axis=0)
                assert ((legs[1:] * legs[:-1]).sum(axis=1) > 0.0).all()

    def test_a_disc_that_fills_the_only_door_leaves_no_way(self) -> None:
        slowness = np.ones((41, 61))
        slowness[:17, 30] = slowness[24:, 30] = np.inf
        time = np.full(slowness.shape, np.inf)
        time[20, 55] = 0.0
        eikonal.sweep_down(time, slowness, 0.1)
        for middle, leads_on in (((3.0, 2.0), False), ((3.0, 3.5), True)):
            discs = np.array([[*middle, 0.4]])
            field = time, 0.0, 0.0, 0.1
            _, here = eikonal.detour(field, slowness, 2.0, 2.0, 2.0, discs, 0.5, 1.0)
            assert math.isfinite(here) is leads_on

    def test_a_goal_that_somebody_stands_on_is_come_near_to(self) -> None:
        slowness = np.ones((41, 61))
        time = np.full(slowness.shape, np.inf)
        time[20, 30] = 0.0
        eikonal.sweep_down(time, slowness, 0.1)
        discs = np.array([[3.0, 2.0, 0.7]])
        field = time, 0.0, 0.0, 0.1
        (around, x0, y0, _), here = eikonal.detour(field, slowness, 1.5, 2.0, 2.0, discs, 0.5, 1.0)
        assert here == pytest.approx(1.5, rel=0.1)
        row, column = np.unravel_index(np.argmin(around), around.shape)
        assert 0.7 <= math.hypot(x0 + 0.1 * column - 3.0, y0 + 0.1 * row - 2.0) + 1e-9 < 0.85
