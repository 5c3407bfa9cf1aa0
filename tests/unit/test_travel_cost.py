"""Costs to everywhere, against the searches that go to one place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.grids.path_lengths import path_lengths
from pilotage.kernels.grids.travel_cost import some_travel_costs, travel_costs
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


@pytest.mark.parametrize("seed", range(20))
def test_lengths_by_lists_are_those_by_a_heap_to_the_bit(seed: int) -> None:
    rng = np.random.default_rng(7400 + seed)
    factor = np.where(rng.random((23, 31)) < 0.3, np.inf, 1.0)
    states = np.pad(np.where(np.isfinite(factor), 0, 128).astype(np.uint8), 1, constant_values=128)
    nearest = np.full(states.shape, np.inf)
    for row, column in rng.permutation(np.argwhere(np.isfinite(factor)))[:12]:
        cost, _ = travel_costs(factor, int(row * 31 + column), 1.0, 1.0)
        whole = np.pad(cost.reshape(factor.shape), 1, constant_values=np.inf)
        start = int((row + 1) * 33 + column + 1)
        length = path_lengths(states.ravel(), 33, start, nearest.ravel()).reshape(states.shape)
        nearer = whole < nearest
        nearer.flat[start] = True
        np.testing.assert_array_equal(length[nearer], whole[nearer])
        assert np.isinf(length[~nearer]).all()
        nearest = np.minimum(nearest, whole)


@pytest.mark.parametrize("seed", range(20))
def test_paths_to_some_are_those_to_all(seed: int) -> None:
    rng = np.random.default_rng(7500 + seed)
    factor = np.where(rng.random((23, 31)) < 0.3, np.inf, 1.0)
    free = np.flatnonzero(np.isfinite(factor))
    start, until = int(free[0]), rng.choice(free, 5, replace=False)
    whole, parents = travel_costs(factor, start, 0.7, 0.7)
    cost, parent = some_travel_costs(factor, start, 0.7, 0.7, until)
    for node in until:
        assert cost[node] == whole[node]
        at = int(node)
        while parents[at] >= 0:
            assert parent[at] == parents[at]
            at = int(parents[at])
