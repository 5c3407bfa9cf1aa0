"""Costs to everywhere, against the searches that go to one place."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.grids.travel_cost import travel_costs
from pilotage.stack.planning.grid_space import GridSpace


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_costs_are_those_of_the_shortest_paths(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocked = rng.random((9, 12)) < 0.3
    blocked[4, 5] = False
    cost, parent = travel_costs(np.where(blocked, np.inf, 1.0), 4 * 12 + 5, 1.0, 1.0)
    space = GridSpace(blocked)
    for row, column in np.argwhere(~blocked):
        path = space.shortest((4, 5), (int(row), int(column)))
        found = float(cost[row * 12 + column])
        assert (path is None) == math.isinf(found)
        if path is not None:
            assert math.isclose(path.length_cells, found, abs_tol=1e-9)
            node, length = int(row * 12 + column), 0.0
            while parent[node] >= 0:
                before = int(parent[node])
                length += math.hypot(node // 12 - before // 12, node % 12 - before % 12)
                node = before
            assert node == 4 * 12 + 5
            assert math.isclose(length, found, abs_tol=1e-9)


def test_spacing_and_factors_count() -> None:
    factor = np.ones((2, 3))
    factor[:, 2] = 3.0
    cost, _ = travel_costs(factor, 0, 0.5, 2.0)
    np.testing.assert_allclose(cost[:3], [0.0, 0.5, 0.5 + 0.5 * 2.0])
    assert cost[3] == 2.0
