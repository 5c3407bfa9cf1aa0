"""Where a robot may drive on a grid: exact at the outlines, nowhere inside what is solid or unknown."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2
from pilotage.kernels.geometry import plane
from pilotage.kernels.rrt.clearance import slack_at
from pilotage.maps import distance_field, ground_distance
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor
from pilotage.maps.ground_distance import with_circles
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.planning.driving_space import space_for
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PlanRequest
from pilotage.stack.planning.rrt_star_dubins import RrtStarDubinsConfig, RrtStarDubinsPlanner

CELLS_M = 0.05


def chart_of(seed: int, theta_rad: float = 0.0) -> WorldMap:
    """Blocks of occupied and of unknown cells on free ground within a rim."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((120, 160), dtype=np.int8)
    for value in (100, -1, 100, -1):
        row, column = rng.integers(10, 80), rng.integers(10, 120)
        cells[row : row + int(rng.integers(1, 40)), column : column + int(rng.integers(1, 40))] = value
    cells[[0, -1], :], cells[:, [0, -1]] = 100, 100
    grid = OccupancyGrid(cells, CELLS_M, Pose2(-1.0, 2.0, theta_rad))
    corners = grid.points_m(np.array([[0, 0], [0, 160], [120, 0], [120, 160]]))
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    return WorldMap("blocks", (float(x0), float(y0), float(x1), float(y1)), grid=grid)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.3]), st.floats(0.15, 0.6))
def test_the_slack_says_whether_a_disc_touches_a_solid_cell(seed: int, theta: float, radius: float) -> None:
    chart = chart_of(seed, theta)
    grid = chart.grid
    assert grid is not None
    space = space_for(chart.field, radius)
    solid = grid.blocked()
    rng = np.random.default_rng(seed)
    rows = np.column_stack([rng.uniform(2.0, 118.0, 80), rng.uniform(2.0, 158.0, 80)])
    blocks = np.argwhere(solid)
    for (row, column), (x, y) in zip(rows, grid.points_m(rows), strict=True):
        off = np.maximum(np.abs(blocks + 0.5 - [row, column]) - 0.5, 0.0)
        away = CELLS_M * float(np.hypot(off[:, 0], off[:, 1]).min())
        if abs(away - radius) > 1e-6:
            assert (slack_at(float(x), float(y), space, radius) >= 0.0) == (away > radius)


def test_unknown_cells_return_no_beam_and_are_not_driven_on() -> None:
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[10:20, 10:20], cells[25:30, 25:30] = -1, 100
    chart = WorldMap("both", (0.0, 0.0, 4.0, 4.0), grid=OccupancyGrid(cells, 0.1))
    assert chart.walls.distance_m(1.5, 2.5) > 0.9, "only the occupied block is a wall"
    assert chart.barriers.distance_m(1.5, 2.95) == pytest.approx(0.05)
    assert chart.field.at(np.array([[1.5, 2.5]]))[0] < -0.4
    assert chart.wall_field.at(np.array([[1.5, 2.5]]))[0] > 0.9
    known = WorldMap("known", chart.bounds_m, grid=OccupancyGrid(np.abs(cells), 0.1))
    assert known.barriers is known.walls


def test_the_corners_around_a_turned_grid_are_no_floor() -> None:
    """They were the larger part of what a patrol told as floor beyond reach."""
    chart = chart_of(3, 0.35)
    xmin, ymin, xmax, ymax = chart.bounds_m
    x, y = np.meshgrid(np.arange(xmin, xmax, 0.2), np.arange(ymin, ymax, 0.2))
    points = np.column_stack([x.ravel(), y.ravel()])
    grid = chart.grid
    assert grid is not None
    places = grid.places_at(points)
    outside = ((places < -2.0) | (places > np.array([grid.rows, grid.columns]) + 2.0)).any(axis=1)
    assert outside.sum() > 100
    assert (chart.field.at(points)[outside] < 0.0).all()
    assert Floor.of(chart, 0.3).apart_fraction < 0.1


def test_discs_found_are_the_same_as_discs_told() -> None:
    world = SegmentMap.of(np.array([[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 4.0]]), np.array([[1.0, 1.0, 0.3]]))
    found = np.array([[3.0, 2.0, 0.5], [4.5, 1.0, 0.03]])
    told = DistanceField.from_map(world.with_obstacles(np.zeros((0, 4)), found))
    later = with_circles(DistanceField.from_map(world), found)
    assert later.distance_m.tobytes() == told.distance_m.tobytes()
    assert (later.circles_m == told.circles_m).all()


def test_a_field_without_geometry_blocks_what_it_says_is_too_near() -> None:
    x_m = 0.05 + 0.1 * np.arange(40)
    away_m = np.hypot(x_m - 2.05, x_m[:, None] - 1.95)
    nothing = np.zeros((0, 4)), np.zeros((0, 3))
    space = space_for(DistanceField(away_m, (0.05, 0.05), 0.1, *nothing), 0.3)
    assert slack_at(1.0, 1.95, space, 0.3) > 0.0
    for x in (1.85, 2.0, 2.05, 2.2):
        assert slack_at(x, 1.95, space, 0.3) < 0.0


@pytest.mark.parametrize("seed", range(6))
def test_paths_on_a_grid_keep_their_clearance_from_solid_and_unknown_cells(seed: int) -> None:
    chart = chart_of(seed)
    planner = RrtStarDubinsPlanner(RrtStarDubinsConfig(clearance_m=0.25, turning_radius_m=0.2, stop="first"))
    start, goal = Pose2(-0.6, 2.4, 0.0), Goal(6.6, 7.6)
    result = planner.plan(PlanRequest(start, goal, chart.field, np.random.default_rng(seed)))
    assert result.path is not None, result.reason
    barriers = chart.barriers
    points = np.ascontiguousarray(result.path.states[:, :2])
    assert plane.least_distance(points, barriers.segments_m, barriers.circles_m) >= 0.25 - 1e-6
    unknown = np.argwhere(chart.grid.cells == -1)  # type: ignore[union-attr]
    row, column = unknown[len(unknown) // 2]
    x, y = chart.grid.centres_m(np.array([[row, column]]))[0]  # type: ignore[union-attr]
    inside = planner.plan(PlanRequest(start, Goal(x, y), chart.field, np.random.default_rng(seed)))
    assert inside.status is PlanStatus.GOAL_BLOCKED
    assert not math.isfinite(inside.first_solution_s)


def coarse_chart(side: int = 20) -> WorldMap:
    """So many cells of 2 m a side, with a block in the middle."""
    cells = np.zeros((side, side), dtype=np.int8)
    cells[8:12, 8:12] = 100
    return WorldMap(
        "coarse", (0.0, 0.0, 2.0 * side, 2.0 * side), grid=OccupancyGrid(cells, 2.0, Pose2(0.0, 0.0, 0.0))
    )


def test_the_field_of_a_large_map_takes_little_more_than_itself() -> None:
    """A map of 600 m took 4 GB, fourteen times its field."""
    chart = coarse_chart(60)
    barriers = chart.barriers
    grid = chart.grid
    assert grid is not None
    size = DistanceField.from_map(barriers).distance_m.nbytes
    tracemalloc.start()
    field = ground_distance.ground_distance(barriers, grid)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert field.distance_m.nbytes == size
    assert peak < 2.5 * size + 150 * ground_distance.ROWS_AT_ONCE * field.distance_m.shape[1]


def test_a_map_of_large_cells_is_not_searched_by_a_tenth_of_a_metre() -> None:
    """60 x 40 cells of 10 m were 24 million nodes: half a minute for each plan at any angle."""
    size_m = (0.0, 0.0, 600.0, 400.0)
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[3:, 30] = 100
    large = WorldMap("large", size_m, grid=OccupancyGrid(cells, 10.0, Pose2(0.0, 0.0, 0.0)))
    assert large.field.resolution_m == 0.4
    assert large.field.distance_m.size < ground_distance.ENOUGH_NODES


def test_a_map_too_large_for_fine_nodes_has_coarser_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was refused: 'take a resolution coarser than 0.1 m', which nobody could say."""
    fine = coarse_chart().field
    monkeypatch.setattr(ground_distance, "ENOUGH_NODES", 50_000)
    coarse = coarse_chart().field
    assert (fine.resolution_m, coarse.resolution_m) == (0.1, 0.2)
    np.testing.assert_allclose(coarse.distance_m, fine.distance_m[::2, ::2], atol=1e-9)


def test_walls_too_far_apart_for_fine_nodes_have_coarser_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hall of 1 km was refused: 'take a resolution coarser than 0.1 m', which nobody could say."""
    walls = SegmentMap.of(np.array([[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 4.0]]), np.zeros((0, 3)))
    fine = DistanceField.from_map(walls)
    monkeypatch.setattr(distance_field, "MAX_NODES", 1_000)
    coarse = DistanceField.from_map(walls)
    assert (fine.resolution_m, coarse.resolution_m) == (0.1, 0.2)
    np.testing.assert_allclose(coarse.distance_m, fine.distance_m[::2, ::2], atol=1e-9)
    with pytest.raises(InputError, match=r"coarser than 0\.1 m"):
        DistanceField.from_map(walls, 0.1)
