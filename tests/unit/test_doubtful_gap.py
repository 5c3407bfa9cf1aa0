"""Gaps that may prove closed: how wide they are, how likely that is, and when the way around is taken."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.geometry.gaps import gap_widths
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.journal import Journal
from pilotage.stack.navigator.detours import Detours
from pilotage.stack.navigator.doubtful_gap import doubtful_gap
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.planning.planner import PLANNERS

RADIUS_M, HIDDEN_M = 0.30, 0.5
NO_WALLS = np.array([[math.inf, 0.0, 0.0]])


def test_a_gap_is_as_wide_as_what_is_across_from_the_nearest_thing() -> None:
    posts = np.array([[0.0, 0.5, 0.03], [0.1, -0.45, 0.03], [0.05, 0.6, 0.03]])
    here = np.zeros((1, 2))
    away, width = gap_widths(here, posts, NO_WALLS, 1.5)
    assert away[0] == pytest.approx(math.hypot(0.1, 0.45) - 0.03)
    assert width[0] == pytest.approx(away[0] + 0.47)
    # What stands on the same side makes no gap, nor does a wall behind it; one across does.
    assert gap_widths(here, posts[[0, 2]], NO_WALLS, 1.5)[1][0] == math.inf
    assert gap_widths(here, posts[:1], np.array([[0.7, 0.0, -1.0]]), 1.5)[1][0] == math.inf
    assert gap_widths(here, posts[:1], np.array([[0.7, 0.0, 1.0]]), 1.5)[1][0] == pytest.approx(0.47 + 0.7)
    away, width = gap_widths(here, posts, NO_WALLS, 0.3)
    assert away[0] == width[0] == math.inf


def _row(from_y_m: float, to_y_m: float) -> FloatArray:
    """Discs of 3 cm at x = 5, as a mapper puts them on a wall that it sees."""
    y = np.arange(from_y_m, to_y_m + 1e-9, 0.05)
    return np.column_stack([np.full(len(y), 5.0), y, np.full(len(y), 0.03)])


def _floor(*walls: list[float]) -> WorldMap:
    sides = [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0], *walls]
    bounds = 0.0, 0.0, 10.0, 8.0
    return WorldMap("floor", bounds, SegmentMap(np.array(sides, dtype=float), np.zeros((0, 3)), bounds))


@pytest.mark.parametrize("spare_m", [0.05, 0.2, 0.45, 0.6])
def test_the_less_a_gap_spares_the_likelier_it_is_closed(spare_m: float) -> None:
    """Between a row of discs and the side wall at y = 0."""
    known = DistanceField.from_map(_floor().walls)
    lowest_m = 2.0 * RADIUS_M + spare_m + 0.03
    x = np.linspace(1.0, 9.0, 161)
    path = np.column_stack([x, np.full(161, 0.5 * (lowest_m - 0.03))])
    gap = doubtful_gap(path, _row(lowest_m, 4.0), known, RADIUS_M, HIDDEN_M)
    if spare_m >= HIDDEN_M:
        assert gap is None
        return
    assert gap is not None
    # The discs' distance counts as seen from the path, walls as sampled.
    assert gap.closed == pytest.approx(1.0 - spare_m / HIDDEN_M, abs=0.03)
    assert gap.before_m == pytest.approx(x[gap.before] - 1.0)
    assert math.dist(path[gap.before], (5.0, lowest_m)) > RADIUS_M + HIDDEN_M
    # Who stands in front of it already has nothing to lose.
    assert doubtful_gap(path[gap.before + 1 :], _row(lowest_m, 4.0), known, RADIUS_M, HIDDEN_M) is None


def _planned_m(
    chart: WorldMap,
    start: Pose2,
    mapped_m: FloatArray,
    hidden_m: float,
    tight_m: float = 0.0,
    squeezing_m: float = 0.0,
    look_m: float = 0.0,
) -> tuple[float, float]:
    """Length of the path adopted to (9, 1), and its highest y."""
    planner = PLANNERS.entry("theta-star").factory(PLANNERS.configure("theta-star", {}, ""))
    plan = GlobalPlan(planner, None, chart, np.random.default_rng(0), Journal(), RADIUS_M)
    plan.make(
        0.0,
        start,
        Goal(9.0, 1.0),
        mapped_m,
        [0.40, 0.36, 0.32, 0.30],
        Detours(1.0, tight_m, squeezing_m, hidden_m, look_m),
    )
    assert plan.path is not None
    return plan.path.length_m, float(plan.path.states[:, 1].max())


def test_the_way_around_is_taken_where_trying_a_gap_likely_costs_more() -> None:
    """A row from 7 cm above what the robot needs at the side wall up to y = 4, open above."""
    planned = partial(_planned_m, _floor(), Pose2(1.0, 1.0, 0.0))
    narrow, wide = _row(0.70, 4.0), _row(1.4, 4.0)
    straight_m, top_m = planned(narrow, 0.0)
    assert straight_m < 8.5
    assert top_m < 1.2
    around_m, top_m = planned(narrow, HIDDEN_M)
    assert top_m > 4.0
    assert around_m > straight_m + 1.0
    # Where what is hidden cannot close it, and where the way around is as good as none, it is tried.
    assert planned(wide, HIDDEN_M) == planned(wide, 0.0)
    assert planned(narrow, 0.05) == planned(narrow, 0.0)
    closed_above = _row(0.70, 8.0)
    assert planned(closed_above, HIDDEN_M) == planned(closed_above, 0.0)


def test_who_is_near_a_gap_that_may_be_closed_looks() -> None:
    """7 cm to spare as it was seen, 6 m farther around: worth a look from nearby."""
    row = _row(0.70, 5.0)
    for x_m, look_m, through in ((3.1, 1.5, True), (3.1, 0.0, False), (1.0, 1.5, False)):
        _, top_m = _planned_m(_floor(), Pose2(x_m, 1.0, 0.0), row, HIDDEN_M, look_m=look_m)
        assert (top_m < 1.2) == through, (x_m, look_m)


def test_it_goes_a_longer_way_not_to_squeeze_but_not_any() -> None:
    """A gap of 5 cm more than it needs at the side wall, seen to be so; 4 m farther around it."""
    planned = partial(_planned_m, _floor(), Pose2(1.0, 1.0, 0.0), hidden_m=0.0, tight_m=0.08)
    tight, roomy = _row(0.68, 5.0), _row(0.76, 5.0)
    assert planned(tight)[0] < 8.5
    assert 10.0 < planned(tight, squeezing_m=5.0)[0] < 14.0
    assert planned(tight, squeezing_m=1.0)[0] < 8.5
    # What spares more than that is driven through all the same, at less clearance than the planner's own.
    assert planned(roomy, squeezing_m=5.0)[0] < 8.5


def test_a_gap_that_is_likely_open_is_tried_where_the_way_around_is_long() -> None:
    """8 m through it, over 14 m around: 32 cm to spare are worth a look, 7 cm are not."""
    planned = partial(_planned_m, _floor(), Pose2(1.0, 1.0, 0.0), hidden_m=HIDDEN_M)
    assert planned(_row(0.95, 6.5))[0] < 8.5
    assert planned(_row(0.70, 6.5))[0] > 14.0
