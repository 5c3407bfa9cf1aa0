"""The outlines of a grid's cells: exact distances, nothing inside, turned with the grid."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import Pose2
from pilotage.kernels.geometry import plane
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.outlines import outlines, rim_lines


def drawn(seed: int, share: float, theta: float = 0.0, unknown: float = 0.0) -> OccupancyGrid:
    """Random cells of 0.2 m."""
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((9, 13)) < share, 100, 0).astype(np.int8)
    cells[rng.random(cells.shape) < unknown] = -1
    return OccupancyGrid.of(cells, 0.2, Pose2(-1.0, 2.0, theta))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.7), st.floats(-3.1, 3.1))
def test_the_distance_from_free_space_is_that_from_the_cells(seed: int, share: float, theta: float) -> None:
    grid = drawn(seed, share, theta)
    solid = np.argwhere(grid.blocked())
    sides = outlines(grid)
    if not solid.size:
        assert sides.shape == (0, 4)
        return
    places = np.random.default_rng(seed + 1).uniform([-2, -2], [11, 15], size=(40, 2))
    beside = np.maximum(np.abs(places[:, None] - solid[None]) - 0.5, 0.0)
    exact = 0.2 * np.hypot(beside[..., 0], beside[..., 1]).min(axis=1)
    for point, away in zip(grid.centres_m(places), exact, strict=True):
        if away > 0.0:
            found = plane.distance_to_nearest(point[0], point[1], sides, plane.NO_CIRCLES)
            assert found == pytest.approx(away, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0))
def test_the_sides_have_the_length_of_the_boundary_and_each_row_is_one_segment(
    seed: int, share: float
) -> None:
    grid = drawn(seed, share)
    solid = np.pad(grid.blocked(), 1).astype(int)
    boundary = 0.2 * (np.abs(np.diff(solid, axis=0)).sum() + np.abs(np.diff(solid, axis=1)).sum())
    sides = outlines(grid)
    lengths = np.hypot(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1])
    assert lengths.sum() == pytest.approx(boundary)
    assert (lengths >= 0.2 - 1e-9).all()
    # No segment goes on where another of its line ends.
    for level in (0, 1):
        flat = sides[np.abs(sides[:, 1 - level] - sides[:, 3 - level]) < 1e-9]
        ends = {
            (round(a, 6), round(b, 6)) for a, b in zip(flat[:, 1 - level], flat[:, 2 + level], strict=True)
        }
        begins = {(round(a, 6), round(b, 6)) for a, b in zip(flat[:, 1 - level], flat[:, level], strict=True)}
        assert not ends & begins


def test_one_cell_is_four_sides_where_it_lies() -> None:
    cells = np.zeros((3, 4), dtype=np.int8)
    cells[2, 1] = 100  # the lowest row
    sides = outlines(OccupancyGrid.of(cells, 0.5, Pose2(1.0, 2.0, 0.0)))
    corners = {(float(x), float(y)) for row in sides for x, y in (row[:2], row[2:])}
    assert corners == {(1.5, 2.0), (2.0, 2.0), (1.5, 2.5), (2.0, 2.5)}
    turned = outlines(OccupancyGrid.of(cells, 0.5, Pose2(1.0, 2.0, math.pi / 2)))
    assert turned[:, [0, 2]].max() == pytest.approx(1.0)
    assert turned[:, [1, 3]].min() == pytest.approx(2.5)


def test_unknown_cells_are_walls_only_where_it_is_said() -> None:
    grid = drawn(3, 0.0, unknown=0.4)
    assert outlines(grid).shape == (0, 4)
    assert len(outlines(grid, unknown_is_solid=True)) > 10


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.9), st.floats(-3.1, 3.1))
def test_middle_lines_run_through_the_cells_that_beams_can_reach(
    seed: int, share: float, theta: float
) -> None:
    grid = drawn(seed, share, theta, unknown=0.1)
    solid = np.pad(grid.blocked(unknown_is_free=True), 1)
    lines = rim_lines(grid)
    for row, column in np.argwhere(solid[1:-1, 1:-1]):
        around = solid[row, column + 1] & solid[row + 2, column + 1]
        around &= solid[row + 1, column] & solid[row + 1, column + 2]
        x, y = grid.centres_m(np.array([[row, column]]))[0]
        away = plane.distance_to_nearest(x, y, lines, plane.NO_CIRCLES)
        assert (away > 0.1) if around else (away < 1e-9)
