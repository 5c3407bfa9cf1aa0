"""In which order to visit places: the best tour, or a good one with how far off it can be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.tours import bound, exact, search

EXACT_UP_TO = 14
"""Places: beyond, dynamic programming takes seconds and hundreds of megabytes."""
KICKS, LEAST_KICKS, MOST_MOVES, BOUND_ROUNDS = 300, 30, 20_000, 200
PAIRS_KICKED = 3_000_000
"""Of places: many of them are kicked less often, for every local search then takes longer."""


@dataclass(frozen=True, slots=True)
class Tour:
    """An order of places.

    Attributes
    ----------
    order
        Every place once, in the order to be visited; a closed tour returns from the last to the first.
    cost, lower_bound
        Of the tour, and what no tour undercuts; they are the same where the tour is known to be the best.
    """

    order: tuple[int, ...]
    cost: float
    lower_bound: float

    @property
    def gap(self) -> float:
        """By which share of the lower bound the tour may at most be too long; 0: it is the best."""
        over = self.cost - self.lower_bound
        return over / self.lower_bound if over > 0.0 and self.lower_bound > 0.0 else max(0.0, over)


def closed_tour(costs: FloatArray, rng: np.random.Generator) -> Tour | None:
    """The tour from place 0 through all others and back.

    Parameters
    ----------
    costs
        (N, N), ``costs[i, j]`` of going from i to j, at least 0, not necessarily the same both ways; infinite
        where there is no way. The diagonal does not count.
    rng
        For the search where places are many.

    Returns
    -------
    The best tour up to ``EXACT_UP_TO`` places (Held and Karp), beyond a local optimum of 2-opt and or-3opt
    with a lower bound; None where no tour was found of finite cost.

    Raises
    ------
    InputError
        Where the matrix is not square, or a cost is negative or not a number.
    """
    given = _checked(costs)
    count = given.shape[0]
    if count < 2:
        return Tour(tuple(range(count)), 0.0, 0.0)
    # A way that is not there costs more than all that are, so that no sum becomes infinity less infinity.
    there = np.isfinite(given)
    forbidden = 1.0 + count * float(given[there].max(initial=0.0))
    finite = np.where(there, given, forbidden)
    if count <= EXACT_UP_TO:
        order = exact.held_karp(given)
        if order.size == 0:
            return None
        cost = search.tour_cost(finite, order)
        return Tour(tuple(order.tolist()), cost, cost)
    first = search.cheapest_insertion(finite)
    kicks = max(LEAST_KICKS, min(KICKS, PAIRS_KICKED // count**2))
    order = search.search(finite, first, rng.random((kicks, 3)), MOST_MOVES)
    cost = search.tour_cost(finite, order)
    if cost >= forbidden:
        return None
    least = bound.lower_bound(finite, cost, BOUND_ROUNDS)
    return Tour(tuple(order.tolist()), cost, min(max(0.0, least), cost))


def open_tour(
    costs: FloatArray, rng: np.random.Generator, start: int | None = None, end: int | None = None
) -> Tour | None:
    """The tour through all places that does not return; ``start`` and ``end`` are free where not given.

    As ``closed_tour``, whose place 0 stands for the way from the end back to the start, which costs nothing.

    Raises
    ------
    InputError
        As there, and where ``start`` and ``end`` are not two different places.
    """
    given = _checked(costs)
    count = given.shape[0]
    for name, place in (("start", start), ("end", end)):
        if place is not None and not 0 <= place < count:
            raise InputError(f"tour: expected a {name} among {count} places, found {place}")
    if start is not None and start == end and count > 1:
        raise InputError(f"tour: expected a start and an end that differ, found {start} twice")
    if start is None:
        around = np.zeros((count + 1, count + 1))
        around[1:, 1:] = given
        places = [-1, *range(count)]
    else:
        places = [start, *(place for place in range(count) if place != start)]
        around = given[np.ix_(places, places)]
    around[:, 0] = [0.0 if end in (None, place) else math.inf for place in places]
    tour = closed_tour(around, rng)
    if tour is None:
        return None
    order = tuple(places[k] for k in tour.order if places[k] >= 0)
    return Tour(order, tour.cost, tour.lower_bound)


def _checked(costs: FloatArray) -> FloatArray:
    matrix = np.array(costs, dtype=np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise InputError(f"tour: expected a square matrix of costs, found the shape {matrix.shape}")
    np.fill_diagonal(matrix, 0.0)
    if not (matrix >= 0.0).all():
        raise InputError("tour: expected costs of 0 or more, found a negative one or one that is no number")
    return matrix
