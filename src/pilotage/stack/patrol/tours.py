"""Closed walks over a patrol graph, and how a team spreads over one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray
from pilotage.models.tour import closed_tour
from pilotage.stack.patrol.graph import PatrolGraph


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """A closed walk along edges.

    Attributes
    ----------
    stops
        (K,) vertices in order, one edge from each to the next and from the last to the first; a vertex that
        the walk passes several times comes as often.
    at_m
        (K,) distance along the walk from the first stop.
    length_m
        Of the whole walk.
    """

    stops: IntArray
    at_m: FloatArray
    length_m: float

    @staticmethod
    def through(graph: PatrolGraph, order: IntArray) -> Round:
        """The walk that visits vertices in an order (K,), by shortest paths."""
        stops: list[int] = []
        for here, there in zip(order, np.roll(order, -1), strict=True):
            stops += graph.path(int(here), int(there))[:-1]
        walk = np.array(stops or [int(order[0])], dtype=np.int64)
        legs = graph.edges_m[walk, np.roll(walk, -1)]
        return Round(walk, np.concatenate([[0.0], np.cumsum(legs)[:-1]]), float(legs.sum()))

    @staticmethod
    def best(graph: PatrolGraph, vertices: tuple[int, ...] | None = None) -> Round:
        """The best closed walk known through some vertices, or all: the same for every robot that asks."""
        return _best(graph, tuple(range(len(graph))) if vertices is None else vertices)


@lru_cache(maxsize=512)
def _best(graph: PatrolGraph, vertices: tuple[int, ...]) -> Round:
    chosen = np.array(vertices, dtype=np.int64)
    # Every robot must come to the same tour: no stream of its own.
    tour = closed_tour(graph.shortest_m[np.ix_(chosen, chosen)], np.random.default_rng(0))
    assert tour is not None  # the graph is connected
    order = chosen[list(tour.order)]
    return Round.through(graph, order)


def idleness_bound_s(graph: PatrolGraph, robots: int, speed_m_s: float) -> float:
    """Worst idleness of robots evenly spread over the best closed walk: length over summed speed."""
    return Round.best(graph).length_m / (robots * speed_m_s)


@dataclass(frozen=True, slots=True)
class Slot:
    """Where a robot enters a walk: at which stop, by its place in ``Round.stops``, and when it leaves it."""

    place: int
    leaves_s: float


def spread(walk: Round, graph: PatrolGraph, starts: IntArray, speed_m_s: float, begin_s: float) -> list[Slot]:
    """Slots for a team on a walk, the same distance apart, so that all go round as early as may be.

    Parameters
    ----------
    starts
        (N,) the vertex where each robot is at ``begin_s``.
    """
    count, stops = len(starts), walk.stops
    best: tuple[float, list[Slot]] | None = None
    for first in range(len(stops)):
        wanted_m = walk.at_m[first] + walk.length_m * np.arange(count) / count
        # The last stop before each slot, and how far the slot is beyond it.
        along_m = wanted_m % walk.length_m if walk.length_m > 0.0 else wanted_m
        place = np.searchsorted(walk.at_m, along_m + 1e-9, side="right") - 1
        beyond_s = np.maximum(0.0, along_m - walk.at_m[place]) / speed_m_s
        ready_s = graph.shortest_m[starts[:, None], stops[place][None, :]] / speed_m_s + beyond_s
        robot, slot = scipy.optimize.linear_sum_assignment(ready_s**2)
        latest_s = float(ready_s[robot, slot].max())
        if best is None or latest_s < best[0] - 1e-9:
            slots = [
                Slot(int(place[k]), begin_s + latest_s - float(beyond_s[k])) for k in slot[np.argsort(robot)]
            ]
            best = latest_s, slots
    assert best is not None  # a walk has at least one stop
    return best[1]
