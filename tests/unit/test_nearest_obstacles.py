"""Distance fields from grids, and nearest obstacles: exact where it counts, bounded elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.build.charts import bounds_of
from pilotage.kernels.geometry import nearest
from pilotage.maps.nearest_obstacles import NearestObstacles
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap

WORLD = SegmentMap.of(
    np.array(
        [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0], [5, 0, 5.3, 3], [2, 5, 4, 7]], float
    ),
    np.array([[7.5, 5.0, 0.6]]),
)
NEAREST = NearestObstacles.from_map(WORLD, 0.1)


@settings(max_examples=200)
@given(st.floats(0, 10), st.floats(0, 8))
def test_never_too_near_and_little_too_far(x: float, y: float) -> None:
    exact = abs(WORLD.distance_m(x, y))
    found = float(NEAREST.at(np.array([[x, y]]))[0])
    inside = math.hypot(x - 7.5, y - 5.0) < 0.6
    assert inside or exact - 1e-9 <= found <= exact + math.sqrt(2.0) * 0.1 + 1e-9


@settings(max_examples=100)
@given(st.floats(0.1, 0.9), st.floats(-0.03, 0.03))
def test_exact_beside_a_wall_also_behind_the_outermost(along: float, aside: float) -> None:
    points = np.array([[10 * along, aside], [2 + 2 * along - 0.7071 * aside, 5 + 2 * along + 0.7071 * aside]])
    assert NEAREST.at(points) == pytest.approx(np.abs([aside, aside]), abs=1e-5)


@settings(max_examples=200)
@given(st.floats(-1, 11), st.floats(-1, 9), st.floats(0, 2), st.floats(0, 2), st.integers(0, 1000))
def test_what_is_nearest_to_a_box_is_so_to_each_of_its_points(
    x: float, y: float, width: float, height: float, seed: int
) -> None:
    box = (x, x + width, y, y + height)
    grid = NEAREST.index, *NEAREST.origin_xy_m, NEAREST.resolution_m
    item = nearest.item_throughout(box, *grid, 10_000)
    share = np.random.default_rng(seed).random((50, 2))
    px, py = x + width * share[:, 0], y + height * share[:, 1]
    by_node = nearest.distances_by_node(px, py, *grid, NEAREST.items)
    if item != nearest.SEVERAL:
        assert nearest.distances_to_item(px, py, NEAREST.items, item) == pytest.approx(by_node, abs=1e-12)
    one = nearest.item_throughout((px[0], px[0], py[0], py[0]), *grid, 1)
    alone = nearest.distances_to_item(px[:1], py[:1], NEAREST.items, one)
    assert alone == pytest.approx(by_node[:1], abs=1e-12)


def grid(theta: float = 0.0) -> OccupancyGrid:
    """A wall one cell thick, a block, some unknown cells."""
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[10, 5:50] = 100
    cells[20:25, 30:40] = 100
    cells[0:3, 0:3] = -1
    return OccupancyGrid.of(cells, 0.1, Pose2(-1.0, 2.0, theta))


def test_an_empty_grid_has_nothing_that_is_nearest() -> None:
    empty = OccupancyGrid.of(np.zeros((3, 4), dtype=np.int8), 0.5)
    chart = WorldMap("empty", (0.0, 0.0, 2.0, 1.5), grid=empty)
    with pytest.raises(InputError, match="walls or discs"):
        NearestObstacles.from_map(chart.walls, 0.1)


@pytest.mark.parametrize("theta", [0.0, 0.7, 3.0])
def test_a_grids_nearest_obstacle_is_the_outline_of_its_cells(theta: float) -> None:
    some = grid(theta)
    occupied = np.argwhere(some.blocked(unknown_is_free=True))
    places = np.random.default_rng(1).uniform([0, 0], [39, 59], size=(300, 2))
    # In cells: a cell is the unit square around its centre.
    beside = np.maximum(np.abs(places[:, None] - occupied[None]) - 0.5, 0.0)
    brute = 0.1 * np.hypot(beside[..., 0], beside[..., 1]).min(axis=1)
    chart = WorldMap("grid", bounds_of(some), grid=some)
    found = NearestObstacles.from_map(chart.walls, 0.1).at(some.centres_m(places))
    outside = brute > 0.0
    assert (found[outside] >= brute[outside] - 1e-9).all()
    assert (found[outside] <= brute[outside] + math.sqrt(2.0) * 0.1 + 1e-9).all()
    near = outside & (brute < 0.03)
    assert near.any()
    assert np.median(found[near] - brute[near]) < 1e-9


def test_misuse_is_told() -> None:
    with pytest.raises(InputError, match="resolution above 0"):
        NearestObstacles.from_map(WORLD, 0.0)
    with pytest.raises(InputError, match="walls or discs"):
        NearestObstacles.from_map(SegmentMap(np.zeros((0, 4)), np.zeros((0, 3)), (0.0, 0.0, 1.0, 1.0)))
