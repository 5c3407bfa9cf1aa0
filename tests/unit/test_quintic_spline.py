"""The quintic spline: its equations against closed forms, and the option that keeps it clear of hazards."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.stack.planning.clear_spline import clear_spline, path_knots
from pilotage.stack.planning.grid_space import GridSpace
from pilotage.stack.planning.quintic_spline import QuinticSpline


def circle(radius_m: float, count: int, turns: float = 1.0) -> FloatArray:
    angle = np.linspace(0.0, 2.0 * math.pi * turns, count)
    return radius_m * np.column_stack([np.cos(angle), np.sin(angle)])


class TestCurve:
    def test_a_straight_line_stays_one(self) -> None:
        for knots in ([[0, 0], [3, 4]], [[0, 0], [0.3, 0.4], [3, 4]], [[0, 0], [0, 0], [3, 4], [3, 4]]):
            spline = QuinticSpline(np.array(knots, dtype=np.float64))
            samples = spline.sampled(11)
            assert spline.length_m == pytest.approx(5.0, abs=1e-12)
            np.testing.assert_allclose(samples.points_xy_m, np.outer(samples.s_m, [0.6, 0.8]), atol=1e-9)
            np.testing.assert_allclose(samples.heading_rad, math.atan2(4, 3), atol=1e-9)
            np.testing.assert_allclose(samples.curvature_per_m, 0.0, atol=1e-9)

    def test_two_turns_of_a_circle(self) -> None:
        """Length, headings that go on beyond pi, and curvature."""
        spline = QuinticSpline(circle(50.0, 401, turns=2.0))
        samples = spline.sampled(1000)
        assert spline.length_m == pytest.approx(200.0 * math.pi, rel=1e-7)
        assert samples.heading_rad[-1] - samples.heading_rad[0] == pytest.approx(4.0 * math.pi, abs=1e-3)
        assert np.all(np.diff(samples.heading_rad) > 0.0)
        np.testing.assert_allclose(samples.curvature_per_m[50:-50], 1.0 / 50.0, rtol=1e-4)
        assert samples.times_s(0.04)[-1] == pytest.approx(5000.0 * math.pi, rel=1e-7)

    def test_headings_hold_their_turn_with_few_samples(self) -> None:
        samples = QuinticSpline(circle(50.0, 401, turns=2.0)).sampled(3)
        assert samples.heading_rad[-1] - samples.heading_rad[0] == pytest.approx(4.0 * math.pi, abs=1e-3)

    @given(st.integers(0, 2**32 - 1), st.integers(2, 40))
    @settings(max_examples=40, deadline=None)
    def test_through_every_knot_in_equal_steps(self, seed: int, count: int) -> None:
        rng = np.random.default_rng(seed)
        directions = np.cumsum(rng.uniform(-1.3, 1.3, count))
        steps = rng.uniform(0.5, 1.5, count)
        knots = np.cumsum(steps[:, None] * np.column_stack([np.cos(directions), np.sin(directions)]), axis=0)
        spline = QuinticSpline(knots)
        at_knots = spline.at(spline.knot_lengths_m()).points_xy_m
        kept = at_knots if count > 2 else at_knots[::2]
        np.testing.assert_allclose(kept, knots, atol=1e-6)
        # The chords of fine equal steps add up to the length and are equal themselves where it is smooth.
        samples = spline.sampled(20_001)
        chords = np.hypot(*np.diff(samples.points_xy_m, axis=0).T)
        assert chords.sum() == pytest.approx(spline.length_m, rel=1e-3)
        assert np.median(chords) == pytest.approx(spline.length_m / 20_000, rel=1e-3)
        # The tangent is where the chords point to.
        middle = 0.5 * (samples.heading_rad[:-1] + samples.heading_rad[1:])
        smooth = np.abs(samples.curvature_per_m[:-1]) * spline.length_m / 20_000 < 0.01
        step = np.diff(samples.points_xy_m, axis=0)[smooth] / chords[smooth, None]
        tangent = np.column_stack([np.cos(middle), np.sin(middle)])[smooth]
        np.testing.assert_allclose(step, tangent, atol=1e-2)

    def test_what_cannot_be_joined(self) -> None:
        for knots in ([[1.0, 2.0]], [[1.0, 2.0], [1.0, 2.0]], [[0.0, 0.0], [np.nan, 1.0]]):
            with pytest.raises(InputError, match="quintic spline: expected"):
                QuinticSpline(np.array(knots))
        spline = QuinticSpline(np.array([[0.0, 0.0], [1.0, 0.0]]))
        with pytest.raises(InputError, match="at least 2 samples"):
            spline.sampled(1)
        with pytest.raises(InputError, match="speed above 0"):
            spline.sampled(5).times_s(0.0)


class TestDistanceToBlocked:
    @given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.6))
    @settings(max_examples=60, deadline=None)
    def test_against_all_cells(self, seed: int, density: float) -> None:
        rng = np.random.default_rng(seed)
        blocked = rng.random((rng.integers(1, 12), rng.integers(1, 12))) < density
        rows, columns = blocked.shape
        places = rng.uniform(-0.5, 0.5 + np.array([rows, columns]), (30, 2))
        places[:10] = np.round(places[:10])
        found = distance_to_blocked(places, blocked, 3)
        for place, distance in zip(places, found, strict=True):
            expected = min(3.0, max(0.0, min(*place, rows - place[0], columns - place[1])))
            for cell in np.argwhere(blocked):
                away = np.maximum(0.0, np.maximum(cell - place, place - cell - 1.0))
                expected = min(expected, float(np.hypot(*away)))
            assert distance == pytest.approx(expected, abs=1e-12)


def grid_of(blocked: BoolArray, side_m: float = 10.0) -> OccupancyGrid:
    return OccupancyGrid.of(blocked, side_m, Pose2(-3.0, 7.0, 0.4))


@st.composite
def paths(draw: st.DrawFn) -> tuple[BoolArray, FloatArray, FloatArray, OccupancyGrid]:
    """A random grid, first knots of a shortest path on it and that path."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.tuples(st.integers(2, 40), st.integers(2, 40)))
    blocked = rng.random(shape) < draw(st.sampled_from([0.0, 0.1, 0.25, 0.35]))
    space = GridSpace(blocked)
    free = np.argwhere(~blocked)
    cells = np.array([[0, 0]])
    for _ in range(20):
        if len(free) < 2:
            break
        ends = [(int(r), int(c)) for r, c in free[rng.choice(len(free), 2, replace=False)]]
        path = space.shortest(ends[0], ends[1])
        if path is not None:
            cells = path.cells
            break
    grid = grid_of(blocked)
    return blocked, path_knots(grid, cells, draw(st.integers(1, 12))), path_knots(grid, cells), grid


class TestClearSpline:
    @given(paths(), st.sampled_from([0.0, 1.0, 3.0]))
    @settings(max_examples=150, deadline=None)
    def test_clear_wherever_one_looks(
        self, problem: tuple[BoolArray, FloatArray, FloatArray, OccupancyGrid], clearance_m: float
    ) -> None:
        """A path that cuts no corners has half a cell's side to both sides: a clear curve always exists."""
        blocked, knots, polyline, grid = problem
        if len(polyline) < 2:
            return
        result = clear_spline(knots, grid, blocked, clearance_m, polyline)
        assert result.spline is not None, result.reason
        points = result.spline.sampled(301 * len(polyline)).points_xy_m
        np.testing.assert_allclose(points[[0, -1]], polyline[[0, -1]], atol=1e-6)
        cells = grid.cells_at(points)
        assert ((cells >= 0) & (cells < blocked.shape)).all()
        assert not blocked[tuple(cells.T)].any()
        least_m = distance_to_blocked(grid.places_at(points), blocked, 2).min() * grid.resolution_m
        assert least_m > clearance_m
        assert least_m == pytest.approx(result.clearance_m, abs=0.1)

    @given(st.floats(0.0, 6.3), st.floats(1.1, 4.9), st.floats(1.1, 4.9))
    @settings(max_examples=60, deadline=None)
    def test_a_path_straight_away_from_all_is_clear(self, angle: float, x: float, y: float) -> None:
        """Its distance grows as much as its length, to within rounding."""
        blocked = np.zeros((9, 9), dtype=np.bool_)
        blocked[0, 0] = True
        grid = grid_of(blocked)
        here, corner = grid.points_m(np.array([[x, y]]))[0], grid.points_m(np.array([[1.0, 1.0]]))[0]
        away = (here - corner) / np.hypot(*(here - corner))
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        for ends in (np.array([here, here + 8.0 * away]), np.array([here, here + 3.0 * turn @ away])):
            result = clear_spline(ends, grid, blocked, 0.0)
            assert result.spline is not None or "the path itself" in result.reason

    def test_far_knots_are_drawn_to_the_path(self) -> None:
        """A hairpin around a long wall: through its ends alone the curve would cut through."""
        blocked = np.zeros((12, 30), dtype=np.bool_)
        blocked[6, :27] = True
        grid = grid_of(blocked)
        path = GridSpace(blocked).shortest((9, 1), (3, 1))
        assert path is not None
        polyline = path_knots(grid, path.cells)
        knots = path_knots(grid, path.cells, 12)
        drawn = QuinticSpline(knots).sampled(1000).points_xy_m
        assert blocked[tuple(grid.cells_at(drawn).T)].any()
        result = clear_spline(knots, grid, blocked, 2.0, polyline)
        assert result.spline is not None
        assert result.rounds > 0
        assert result.clearance_m > 2.0

    def test_a_path_that_touches_hazards_says_where(self) -> None:
        blocked = np.array([[False, True], [True, False]])
        path = GridSpace(blocked).shortest((0, 0), (1, 1), cut_corners=True)
        assert path is not None
        grid = OccupancyGrid.of(blocked, 10.0)
        result = clear_spline(path_knots(grid, path.cells), grid, blocked)
        assert result.spline is None
        assert "the path itself comes within 0 m of blocked ground at (10, 10)" in result.reason

    def test_outside_the_grid_is_no_free_ground(self) -> None:
        grid = OccupancyGrid.of(np.zeros((4, 4), dtype=np.bool_), 10.0)
        result = clear_spline(np.array([[5.0, 5.0], [-20.0, 5.0], [5.0, 35.0]]), grid, grid.blocked())
        assert result.spline is None

    def test_misuse(self) -> None:
        grid = OccupancyGrid.of(np.zeros((4, 4), dtype=np.bool_), 10.0)
        line = np.array([[5.0, 5.0], [25.0, 5.0]])
        for clearance_m in (-1.0, 15.0, math.nan):
            with pytest.raises(InputError, match="expected a clearance"):
                clear_spline(line, grid, grid.blocked(), clearance_m)
        with pytest.raises(InputError, match="a path that moves"):
            clear_spline(line[:1], grid, grid.blocked())
        with pytest.raises(InputError, match="points of the path"):
            clear_spline(line + 1.0, grid, grid.blocked(), 0.0, line)
        with pytest.raises(InputError, match="n from 1"):
            path_knots(grid, np.array([[0, 0], [0, 1]]), 0)
