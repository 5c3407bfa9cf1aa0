"""In which order to visit several places: along collision-free paths on the robot's own map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Goal, IntArray, Pose2
from pilotage.maps.floor import Floor
from pilotage.maps.world_map import WorldMap
from pilotage.models.tour import open_tour


@dataclass(frozen=True, slots=True)
class Rounds:
    """An order of places.

    Attributes
    ----------
    order
        Every place once, in the order to be visited.
    length_m, given_m
        Of the shortest paths from the start through all places in this order, and in the one that was given.
    bound_m
        What no order undercuts; the length itself where the order is known to be the best.
    """

    order: tuple[int, ...]
    length_m: float
    given_m: float
    bound_m: float


def best_rounds(
    chart: WorldMap,
    start: Pose2 | None,
    places: tuple[Goal, ...],
    ends_at_last: bool,
    clearance_m: float,
    rng: np.random.Generator,
) -> Rounds:
    """The best order up to a dozen places, beyond a good one (see ``models.tour``).

    Paths are those of a point that keeps the clearance, over cells of 10 cm and then pulled tight: headings
    and turning radius play no part, nor does what the robot is yet to find.

    Parameters
    ----------
    start
        Where the robot believes to begin; None: it does not know, and any place may be the first.
    ends_at_last
        Whether the last place stays the last.

    Raises
    ------
    InputError
        Where a place cannot be reached.
    """
    points = np.array([(place.x_m, place.y_m) for place in places])
    if start is not None:
        points = np.vstack([[start.x_m, start.y_m], points])
    inside = float(points[0, 0]), float(points[0, 1])
    floor = Floor.of(chart, clearance_m, inside_xy_m=inside)
    lengths_m = floor.lengths_m(points, np.ones((len(points), len(points)), np.bool_), "goal")
    begin = None if start is None else 0
    tour = open_tour(lengths_m, rng, begin, len(points) - 1 if ends_at_last else None)
    assert tour is not None, "all places lie on one floor"
    order = tour.order if start is None else tuple(place - 1 for place in tour.order[1:])
    return Rounds(order, tour.cost, _along(lengths_m, np.arange(len(points))), tour.lower_bound)


def _along(lengths_m: FloatArray, order: IntArray) -> float:
    """Of the paths from each to the next."""
    return float(lengths_m[order[:-1], order[1:]].sum())
