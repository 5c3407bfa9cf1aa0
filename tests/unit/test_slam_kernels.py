"""Kernels of the mapper: alignment, its covariance, the search, and the grids they work on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.align import CAPPED, CONVERGED, TOO_FEW, align, normal_equations, pair_up
from pilotage.kernels.slam.branch_bound import NO_SEED, PASS_OVER_NONE, search_window
from pilotage.kernels.slam.buckets import BEYOND_M, nearest, sort_into_buckets
from pilotage.kernels.slam.frames import between, carried, composed
from pilotage.kernels.slam.match_grid import score_grid, scores_of
from pilotage.kernels.slam.occupancy import HIT_ODDS, MISS_ODDS, MOST_ODDS, add_scan
from pilotage.kernels.slam.scan_lines import scan_lines, scan_points
from support.laser_rooms import BEAMS, SPAN_RAD, furnished, ranges

ANGLES = np.linspace(-0.5 * SPAN_RAD, 0.5 * SPAN_RAD, BEAMS)
RAYS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
NO_PRIOR = 1e-9 * np.eye(3)
HERE = np.array([2.0, 3.5, 0.2])


def cloud(pose: FloatArray, noise: FloatArray | float = 0.0) -> FloatArray:
    points, hit = scan_points(ranges(furnished(), pose, ANGLES) + noise, RAYS, 0.1, 30.0)
    return scan_lines(points, hit, float(ANGLES[1] - ANGLES[0]))


def aligned(
    source: FloatArray, start: FloatArray, reference: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    box, starts, _, points = sort_into_buckets(reference, 0.25)
    return align(source, start, NO_PRIOR, 0.4, 0.2, 0.05, 50, box, starts, points)


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-0.08, 0.08))
def test_a_known_displacement_is_found(dx: float, dy: float, turn: float) -> None:
    there = composed(HERE, np.array([dx, dy, turn]))
    pose, _, _, status = aligned(cloud(there), np.zeros(3), cloud(HERE))
    assert status in {CONVERGED, CAPPED}
    assert np.hypot(pose[0] - dx, pose[1] - dy) < 0.01
    assert abs(pose[2] - turn) < 0.004


def test_the_gradient_is_that_of_the_residuals() -> None:
    """Against central differences of half the squared residuals, pairs and weights held."""
    box, starts, _, points = sort_into_buckets(cloud(HERE), 0.25)
    source = cloud(HERE)[20:160]
    hessian, gradient = np.zeros((3, 3)), np.zeros(3)
    paired, unknown = np.full(len(source), -1), np.full((len(source), 3), -1.0)
    at = np.array([1e-3, -5e-4, 2e-4])
    pair_up(source, at[0], at[1], at[2], 0.2, box, starts, points, paired, unknown)
    # So wide a scale weighs all pairs with one.
    normal_equations(source, at[0], at[1], at[2], 0.2, 1e6, points, paired, hessian, gradient)
    numeric = np.zeros(3)
    for k in range(3):
        for sign in (1.0, -1.0):
            moved = at.copy()
            moved[k] += sign * 1e-7
            h, g = np.zeros((3, 3)), np.zeros(3)
            squares, _, _ = normal_equations(
                source, moved[0], moved[1], moved[2], 0.2, 1e6, points, paired, h, g
            )
            numeric[k] += sign * 0.5 * squares / 2e-7
    assert gradient == pytest.approx(numeric, rel=1e-3, abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(1e-4, 0.03))
def test_a_pair_that_is_kept_is_the_one_that_would_be_found(seed: int, step: float) -> None:
    """However the poses go on and the reach shrinks: the same sums to the last bit, and the same pairs."""
    rng = np.random.default_rng(seed)
    box, starts, _, points = sort_into_buckets(
        np.concatenate([cloud(HERE, 0.02 * rng.standard_normal(BEAMS)) for _ in range(3)]), 0.2
    )
    source, at, reach = cloud(HERE), 0.05 * rng.standard_normal(3), 0.4
    kept = np.full(len(source), -1), np.full((len(source), 3), -1.0)
    for _ in range(12):
        fresh = np.full(len(source), -1), np.full((len(source), 3), -1.0)
        told = []
        for paired, stands in (kept, fresh):
            hessian, gradient = np.zeros((3, 3)), np.zeros(3)
            pair_up(source, at[0], at[1], at[2], reach, box, starts, points, paired, stands)
            sums = normal_equations(
                source, at[0], at[1], at[2], reach, 0.05, points, paired, hessian, gradient
            )
            told.append([*sums, *hessian.ravel(), *gradient])
        assert told[0] == told[1]
        assert told[0][2] > 0
        at = at + step * rng.standard_normal(3)
        reach = max(0.1, reach * float(rng.choice([0.6, 1.0])))


def test_the_covariance_of_a_match_is_that_of_many_matches() -> None:
    """Monte Carlo over range noise: inverse Hessian times the points' variance, within a factor of two.

    120 draws: a true ratio of one would fall outside of 0.5 to 2 far less than once in a thousand times.
    """
    rng = np.random.default_rng(7)
    std_m = 0.01
    reference = cloud(HERE)
    poses, hessians = [], []
    for _ in range(120):
        pose, hessian, _, _ = aligned(cloud(HERE, std_m * rng.standard_normal(BEAMS)), np.zeros(3), reference)
        poses.append(pose)
        hessians.append(hessian)
    told = np.sqrt(np.diag(np.linalg.inv(np.mean(hessians, axis=0)) * std_m**2))
    found = np.std(poses, axis=0)
    assert (found / told > 0.5).all()
    assert (found / told < 2.0).all()


def test_a_bare_corridor_leaves_its_direction_open() -> None:
    walls = np.array([(-60.0, -1.0, 60.0, -1.0), (-60.0, 1.0, 60.0, 1.0)])
    points, hit = scan_points(ranges(walls, np.zeros(3), ANGLES), RAYS, 0.1, 25.0)
    lines = scan_lines(points, hit, float(ANGLES[1] - ANGLES[0]))
    _, hessian, _, _ = aligned(lines, np.zeros(3), lines)
    assert hessian[0, 0] < 1e-3 * hessian[1, 1]


def test_too_few_points_are_said() -> None:
    _, _, _, status = aligned(cloud(HERE)[:5], np.zeros(3), cloud(HERE))
    assert status == TOO_FEW
    box, starts, _, points = sort_into_buckets(np.zeros((0, 6)), 0.25)
    assert nearest(0.0, 0.0, 1.0, -1, box, starts, points)[0] == -1


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.05, 0.8))
def test_the_nearest_point_is_the_nearest(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    cloud_ = np.zeros((60, 6))
    cloud_[:, 4:6] = rng.uniform(-2.0, 2.0, (60, 2))
    box, starts, order, points = sort_into_buckets(cloud_, 0.25)
    assert (points[:, :2] == cloud_[order, 4:6]).all()
    for x, y in rng.uniform(-2.5, 2.5, (20, 2)):
        distance = np.hypot(points[:, 0] - x, points[:, 1] - y)
        wanted = int(distance.argmin()) if distance.min() < reach else -1
        next_m = np.sort(distance)[1]
        for guess in (-1, int(distance.argmin()), *rng.integers(60, size=3).tolist()):
            found, least, second = nearest(x, y, reach, guess, box, starts, points)
            assert found == wanted
            assert least == pytest.approx(min(distance.min(), reach) ** 2)
            # As far away as the next one, or as it was looked.
            looked = reach if guess < 0 else min(reach, distance[guess] + BEYOND_M)
            assert second == pytest.approx(min(next_m, looked) ** 2)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31))
def test_branch_and_bound_finds_what_looking_everywhere_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = np.where(rng.random((40, 50)) < 0.1, rng.random((40, 50)), -0.2 * (rng.random((40, 50)) < 0.5))
    grid = grid.astype(np.float32)
    points = rng.uniform(-0.8, 0.8, (25, 2))
    centre, angles = np.array([2.0, 2.0, 0.3]), np.array([-0.2, 0.0, 0.2])
    scores = scores_of(grid, 3, np.zeros(2), 0.1)
    best, _ = search_window(
        scores,
        points,
        centre,
        0.7,
        angles,
        -10.0,
        PASS_OVER_NONE,
        10**6,
        NO_SEED,
        False,
    )
    everywhere, _ = search_window(
        scores_of(grid, 0, np.zeros(2), 0.1),
        points,
        centre,
        0.7,
        angles,
        -10.0,
        PASS_OVER_NONE,
        10**6,
        NO_SEED,
        False,
    )
    assert best[3] == pytest.approx(everywhere[3], abs=1e-6)
    for seed_pose in (best[:3], centre + np.array([0.5, -0.4, 0.1]), centre + 3.0):
        seeded, _ = search_window(
            scores,
            points,
            centre,
            0.7,
            angles,
            -10.0,
            PASS_OVER_NONE,
            10**6,
            seed_pose,
            False,
        )
        assert (seeded == best).all()


@pytest.mark.parametrize("levels", [0, 3])
@pytest.mark.parametrize("centre_m", [(2.0, 2.0), (0.3, 2.0), (2.0, 0.2), (4.7, 2.0), (2.0, 3.9)])
def test_scores_are_those_of_the_cells_that_the_points_fall_into(
    centre_m: tuple[float, float], levels: int
) -> None:
    """Inside a grid no point is held against its borders: clouds in it, and across each of its borders."""
    rng = np.random.default_rng(3)
    grid = rng.random((40, 50)).astype(np.float32)
    points = rng.uniform(-0.8, 0.8, (26, 2))
    bordered = np.pad(grid, 40)  # nothing was seen out there
    scores = scores_of(grid, levels, np.zeros(2), 0.1)
    for shift in np.ndindex(15, 15):
        at = centre_m + 0.1 * (np.array(shift) - 7)
        window = (scores, points, np.array([*at, 0.0]), 0.0, np.zeros(1))
        best, _ = search_window(*window, 0.0, PASS_OVER_NONE, 10**6, NO_SEED, False)
        column, row = np.floor((points + at) / 0.1).astype(int).T
        assert best[3] == pytest.approx(bordered[row + 40, column + 40].mean(dtype=float), abs=1e-9)


def test_the_second_best_is_elsewhere() -> None:
    grid = np.zeros((30, 60), np.float32)
    grid[15, 10], grid[15, 40] = 1.0, 0.9
    scores = scores_of(grid, 3, np.zeros(2), 0.1)
    point, centre = np.zeros((1, 2)), np.array([2.5, 1.5, 0.0])
    window = (scores, point, centre, 2.0, np.zeros(1))
    best, _ = search_window(*window, 0.1, PASS_OVER_NONE, 10**6, NO_SEED, False)
    other, _ = search_window(*window, 0.1, np.array([*best[:3], 0.8, 0.3, 0.0, 0.0]), 10**6, NO_SEED, False)
    assert best[3] == pytest.approx(1.0)
    assert other[3] == pytest.approx(0.9)
    some, looked = search_window(*window, 0.1, PASS_OVER_NONE, 10**6, NO_SEED, True)
    assert some[3] in (pytest.approx(1.0), pytest.approx(0.9))
    assert looked <= search_window(*window, 0.1, PASS_OVER_NONE, 10**6, NO_SEED, False)[1]
    assert np.hypot(*(best[:2] - other[:2])) > 2.5
    beside, _ = search_window(*window, 0.1, np.array([*best[:3], 0.8, 0.3, 1.0, 0.0]), 10**6, NO_SEED, False)
    assert beside[3] == -np.inf  # both lie on one line along x


def test_walls_score_and_open_floor_counts_against() -> None:
    points = cloud(HERE)[:, :2]
    low, high = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    grid = score_grid(
        np.ascontiguousarray(points),
        np.zeros((1, 2)),
        np.array([len(points)]),
        np.concatenate([low, high]),
        0.1,
        0.12,
        -0.4,
    )
    column, row = np.floor((points - low) / 0.1).astype(int).T
    assert grid[row, column].min() > 0.5
    column, row = np.floor((0.5 * points - low) / 0.1).astype(int).T
    assert np.mean(grid[row, column] < 0.0) > 0.7


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_between_undoes_composed(values: list[float]) -> None:
    a, b = np.array(values[:3]), np.array(values[3:])
    assert between(a, composed(a, b)) == pytest.approx(b, abs=1e-9)
    points = np.arange(12.0).reshape(2, 6)
    there = carried(points, a)
    assert carried(there, between(a, np.zeros(3)))[:, [0, 1, 4, 5]] == pytest.approx(
        points[:, [0, 1, 4, 5]], abs=1e-9
    )


def test_a_beam_clears_its_way_and_marks_its_end() -> None:
    odds = np.zeros((10, 40), np.int8)
    scan = np.array([0.55, 0.55, 0.0]), np.array([2.0, np.nan, np.inf]), 0.0, 1e-9, 3.0
    add_scan((odds, 0.0, 0.0, 0.1), *scan)
    assert odds[5, 25] == HIT_ODDS - MISS_ODDS
    assert (odds[5, 6:25] == -2 * MISS_ODDS).all()
    assert odds[5, 36:].max() <= 0
    assert (odds[:5] == 0).all()
    for _ in range(MOST_ODDS // MISS_ODDS):
        add_scan((odds, 0.0, 0.0, 0.1), *scan)
    assert (odds[5, 6:25] == -MOST_ODDS).all()


def test_a_beam_that_nothing_came_back_from_ends_at_a_wall() -> None:
    """What lies behind stays unknown, and the wall a wall; a cell that one scan alone marked is cleared."""
    odds = np.zeros((3, 60), np.int8)
    odds[1, 30], odds[1, 15] = HIT_ODDS + 1, HIT_ODDS
    add_scan((odds, 0.0, 0.0, 0.1), np.array([0.05, 0.15, 0.0]), np.array([np.inf]), 0.0, 1e-9, 5.0)
    assert (odds[1, 1:15] == -MISS_ODDS).all()
    assert (odds[1, 15], odds[1, 30]) == (HIT_ODDS - MISS_ODDS, HIT_ODDS + 1)
    assert (odds[1, 31:] == 0).all()


def test_lines_go_on_over_beams_that_are_missing() -> None:
    """A wall of which a third of the beams is lost keeps its lines; an opening of three beams ends them."""
    wall = np.array([(2.0, -3.0, 2.0, 3.0)])
    measured = ranges(wall, np.zeros(3), ANGLES)
    lost = np.where(np.random.default_rng(9).random(measured.size) < 0.33, np.inf, measured)
    points, hit = scan_points(lost, RAYS, 0.1, 25.0)
    lines = scan_lines(points, hit, float(ANGLES[1] - ANGLES[0]))
    assert (np.hypot(lines[:, 2], lines[:, 3]) > 0.5).mean() > 0.9
    middle = measured.size // 2
    few = np.full(measured.size, np.inf)
    few[[middle - 3, middle - 2, middle + 2, middle + 3]] = measured[
        [middle - 3, middle - 2, middle + 2, middle + 3]
    ]
    points, hit = scan_points(few, RAYS, 0.1, 25.0)
    assert not scan_lines(points, hit, float(ANGLES[1] - ANGLES[0]))[:, 2:4].any()
