"""Tours: against all permutations, the two methods against each other, and bounds that bound."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.tours import bound, exact, search
from pilotage.models.tour import EXACT_UP_TO, closed_tour, open_tour


def draw(seed: int, count: int, kind: str) -> FloatArray:
    """Costs between random places of the plane, the same both ways, or up and down a slope, or at random."""
    rng = np.random.default_rng(seed)
    places = rng.random((count, 2))
    away = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    if kind == "slope":
        return np.asarray(away + 0.5 * np.maximum(0.0, places[None, :, 1] - places[:, None, 1]))
    return away if kind == "plane" else rng.random((count, count))


def cost_of(costs: FloatArray, order: tuple[int, ...], closed: bool) -> float:
    """Of an order, added up anew."""
    pairs = itertools.pairwise((*order, order[0]) if closed else order)
    return float(sum(costs[a, b] for a, b in pairs))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 6), st.sampled_from(["plane", "slope", "random"]))
def test_tours_are_the_best_of_all_permutations(seed: int, count: int, kind: str) -> None:
    costs = draw(seed, count, kind)
    rng = np.random.default_rng(0)
    orders = list(itertools.permutations(range(count)))
    best = {
        "closed": min(cost_of(costs, order, True) for order in orders),
        "open": min(cost_of(costs, order, False) for order in orders),
        "from": min(cost_of(costs, order, False) for order in orders if order[0] == 1),
        "between": min(cost_of(costs, order, False) for order in orders if (order[0], order[-1]) == (1, 0)),
    }
    found = {
        "closed": closed_tour(costs, rng),
        "open": open_tour(costs, rng),
        "from": open_tour(costs, rng, start=1),
        "between": open_tour(costs, rng, start=1, end=0),
    }
    for name, tour in found.items():
        assert tour is not None
        assert sorted(tour.order) == list(range(count))
        assert tour.gap == 0.0
        assert tour.cost == pytest.approx(best[name], abs=1e-12)
        assert tour.cost == pytest.approx(cost_of(costs, tour.order, name == "closed"), abs=1e-12)


@pytest.mark.parametrize("kind", ["plane", "slope", "random"])
def test_local_search_and_bound_hold_the_optimum_between_them(kind: str) -> None:
    """Ten seeds each; the search finds the optimum of 13 places, the bound never lies above it."""
    for seed in range(10):
        costs = draw(seed, 13, kind)
        best = search.tour_cost(costs, exact.held_karp(costs))
        first = search.cheapest_insertion(costs)
        assert sorted(first.tolist()) == list(range(13))
        assert first[0] == 0
        order = search.search(costs, first, np.random.default_rng(seed).random((100, 3)), 10_000)
        assert sorted(order.tolist()) == list(range(13))
        assert order[0] == 0
        assert search.tour_cost(costs, order) == pytest.approx(best, rel=1e-9)
        least = bound.lower_bound(costs, best, 200)
        assert 0.9 * best <= least <= best + 1e-9


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 5))
def test_the_arborescence_is_the_cheapest(seed: int, count: int) -> None:
    costs = draw(seed, count, "random")

    def reaches(before: tuple[int, ...]) -> bool:
        for place in range(1, count):
            on = place
            for _ in range(count):
                on = before[on - 1] if on else 0
            if on:
                return False
        return True

    trees = [tree for tree in itertools.product(range(count), repeat=count - 1) if reaches(tree)]
    best = min(sum(costs[tree[j - 1], j] for j in range(1, count)) for tree in trees)
    found = bound.arborescence(costs)
    assert reaches(tuple(found[1:].tolist()))
    assert found[0] == -1
    assert sum(costs[found[j], j] for j in range(1, count)) == pytest.approx(best)


def test_many_places_are_told_with_their_gap() -> None:
    costs = draw(3, 60, "plane")
    tour = closed_tour(costs, np.random.default_rng(0))
    assert tour is not None
    assert sorted(tour.order) == list(range(60))
    assert tour.cost == pytest.approx(cost_of(costs, tour.order, True))
    assert tour.lower_bound <= tour.cost
    assert tour.gap < 0.03
    assert tour == closed_tour(costs, np.random.default_rng(0))


@pytest.mark.parametrize("count", [6, EXACT_UP_TO + 4])
def test_ways_that_are_not_there(count: int) -> None:
    """A ring that can be walked one way only has one tour; cut open it has none, but one through it."""
    ring = np.full((count, count), np.inf)
    for k in range(count):
        ring[k, (k + 1) % count] = 1.0
    rng = np.random.default_rng(1)
    tour = closed_tour(ring, rng)
    assert tour is not None
    assert tour.order == tuple(range(count))
    assert tour.cost == count
    ring[count - 1, 0] = np.inf
    assert closed_tour(ring, rng) is None
    through = open_tour(ring, rng)
    assert through is not None
    assert through.order == tuple(range(count))
    assert open_tour(ring, rng, start=1) is None


def test_what_is_no_matrix_of_costs_is_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="square"):
        closed_tour(np.zeros((2, 3)), rng)
    with pytest.raises(InputError, match="no number"):
        closed_tour(np.array([[0.0, np.nan], [1.0, 0.0]]), rng)
    with pytest.raises(InputError, match="negative"):
        closed_tour(np.array([[0.0, -1.0], [1.0, 0.0]]), rng)
    with pytest.raises(InputError, match="among 2 places"):
        open_tour(np.zeros((2, 2)), rng, start=2)
    with pytest.raises(InputError, match="differ"):
        open_tour(np.zeros((2, 2)), rng, start=1, end=1)


def test_one_place_and_none() -> None:
    rng = np.random.default_rng(0)
    for count in (0, 1):
        for tour in (closed_tour(np.zeros((count, count)), rng), open_tour(np.zeros((count, count)), rng)):
            assert tour is not None
            assert tour.order == tuple(range(count))
            assert tour.cost == 0.0


@settings(max_examples=100, deadline=None)
@given(
    st.integers(0, 10_000),
    st.integers(1, 7),
    st.sampled_from(["plane", "slope", "random"]),
    st.booleans(),
    st.booleans(),
)
def test_a_place_is_put_in_where_it_lengthens_a_tour_least(
    seed: int, count: int, kind: str, leaves: bool, comes: bool
) -> None:
    costs = draw(seed, count + 1, kind)
    np.fill_diagonal(costs, 0.0)
    order = np.random.default_rng(seed).permutation(count)
    out, into = int(order[seed % count]) if leaves else -1, count if comes else -1
    left = [place for place in order.tolist() if place != out]
    found = search.exchanged(costs, order, out, into)
    assert [place for place in found.tolist() if place != into] == left
    assert (into in found.tolist()) == comes
    every = [(*left[:k], into, *left[k:]) for k in range(max(len(left), 1))] if comes else [tuple(left)]
    best = min(cost_of(costs, other, True) if len(other) > 1 else 0.0 for other in every)
    told = search.exchanged_cost(costs, order, out, into)
    assert told == pytest.approx(best, abs=1e-9)
    assert told == pytest.approx(cost_of(costs, tuple(found.tolist()), True) if len(found) > 1 else 0.0)
