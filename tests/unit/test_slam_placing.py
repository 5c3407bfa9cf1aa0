"""Placing a scan by guesses: points fused for it, which guess wins, what it slipped."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.align import CONVERGED, TOO_FEW, align
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between, between_all, carried, composed
from pilotage.kernels.slam.local_map import (
    CELL_M,
    CELLS,
    LATER_M,
    MET,
    NOTHING_KNOWN,
    PRIOR,
    REACH_M,
    LocalMap,
    add_to_map,
    align_in_map,
    empty_map,
    looked_up,
)
from pilotage.kernels.slam.match_grid import max_pyramid
from pilotage.kernels.slam.movers import bearing_of
from pilotage.kernels.slam.placing import (
    distinct_readings,
    guessed_motions,
    learn_motion,
    placed,
    plausibility,
)
from pilotage.kernels.slam.scan_lines import lines_of, scan_cloud, scan_points
from pilotage.kernels.slam.slips import told_by
from support.laser_rooms import BEAMS, SPAN_RAD, furnished, ranges

ANGLES = np.linspace(-0.5 * SPAN_RAD, 0.5 * SPAN_RAD, BEAMS)
RAYS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
HERE = np.array([2.0, 3.5, 0.2])


def cloud(pose: FloatArray, noise: FloatArray | float = 0.0) -> FloatArray:
    return scan_cloud(
        ranges(furnished(), pose, ANGLES) + noise, RAYS, float(ANGLES[1] - ANGLES[0]), 0.1, 30.0
    )


def test_lines_of_some_beams_are_those_of_the_whole_scan() -> None:
    seen = ranges(furnished(), HERE, ANGLES)
    seen[40:44] = np.nan
    points, hit = scan_points(seen, RAYS, 0.1, 30.0)
    step, beams = float(ANGLES[1] - ANGLES[0]), np.flatnonzero(hit)
    np.testing.assert_array_equal(
        lines_of(points, hit, beams[1::3].copy(), step),
        scan_cloud(seen, RAYS, step, 0.1, 30.0)[1::3],
    )


def test_what_is_written_row_by_row_is_what_is_nearest() -> None:
    """Of all cells at most one in a hundred holds a point that is not the nearest of the fused ones."""
    rng = np.random.default_rng(3)
    noisy = map_of(*(cloud(HERE, 0.01 * rng.standard_normal(BEAMS)) for _ in range(6)))
    points = noisy.points[: noisy.counts[0]]
    cells = (np.floor(rng.uniform(0.0, 10.0, (4000, 2)) / CELL_M) + 0.5) * CELL_M
    found = np.empty(len(cells), np.int64)
    looked_up(noisy, cells, 0.0, 0.0, 0.0, found)
    away = np.hypot(*np.moveaxis(cells[:, None] - points[:, :2], 2, 0))
    near = away.min(axis=1) < REACH_M - 0.05
    assert near.sum() > 400
    told = np.where(found >= 0, away[np.arange(len(cells)), found], np.inf)
    # What was written stays where running means moved the points by millimetres.
    assert (told[near] > away.min(axis=1)[near] + 0.02).mean() < 0.01


def map_of(*scans: FloatArray, led: bool = True, kept: int = 15, at: FloatArray = HERE) -> LocalMap:
    out = empty_map(20_000)
    for scan in scans:
        add_to_map(out, scan, at, kept, led)
    return out


def points_of(map_: LocalMap) -> FloatArray:
    return map_.points[: map_.counts[0], :4]


def test_what_several_scans_saw_of_a_wall_is_one_row_of_points_on_it() -> None:
    rng = np.random.default_rng(3)
    scans = [cloud(HERE, 0.01 * rng.standard_normal(BEAMS)) for _ in range(15)]
    at = HERE + np.array([0.0, 0.05, 0.0])
    alone, kept = (points_of(map_of(*scans, led=led, at=at)) for led in (False, True))
    all_ = np.concatenate([carried(scan, at) for scan in scans])[:, :4]
    assert len(kept) < 0.2 * len(all_)
    # Without odometry all that is farther apart than a few centimetres stays apart.
    assert 1.2 * len(kept) < len(alone) < 0.2 * len(all_)
    lined = kept[:, 2:].any(axis=1)
    assert np.allclose(np.hypot(kept[lined, 2], kept[lined, 3]), 1.0)
    # On the outer wall, in the middle of a row of squares, means lie nearer to the wall than single points.
    spreads = []
    for part in (all_, kept):
        wall = part[(np.abs(part[:, 1] - 0.05) < 0.05) & (np.abs(part[:, 3]) > 0.95)]
        spreads.append(float(np.sqrt(np.mean((wall[:, 1] - 0.05) ** 2))))
    assert spreads[1] < 0.7 * spreads[0]


def test_walls_seen_from_both_sides_stay_two() -> None:
    front = np.array([[0.05, 0.05, 0.0, 1.0, 0.05, 0.05]])
    back = np.array([[0.06, 0.06, 0.0, -1.0, 0.06, 0.06]])
    bare = np.array([[0.05, 0.06, 0.0, 0.0, 0.05, 0.06]])
    map_ = empty_map(10)
    add_to_map(map_, np.concatenate([front, back, bare, front]), np.zeros(3), 15, True)
    assert len(points_of(map_)) == 3


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31), st.booleans())
def test_the_point_that_is_looked_up_is_about_the_nearest(seed: int, led: bool) -> None:
    """Against all of them: none is nearer by more than a cell's diagonal and what is allowed for age."""
    rng = np.random.default_rng(seed)
    map_ = map_of(*[cloud(HERE, 0.01 * rng.standard_normal(BEAMS)) for _ in range(10)], led=led)
    asked = rng.uniform((-0.5, -0.5), (9.0, 8.0), (300, 2))
    source, paired = np.zeros((300, 6)), np.empty(300, np.int64)
    source[:, :2] = asked
    looked_up(map_, source, 0.0, 0.0, 0.0, paired)
    far = np.hypot(*(asked[:, None] - points_of(map_)[None, :, :2]).transpose(2, 0, 1))
    found = paired >= 0
    assert 20 < found.sum() < 300
    told = far[np.flatnonzero(found), paired[found]]
    assert (told - far[found].min(axis=1) < 1.5 * CELL_M + LATER_M).all()
    assert (far[~found].min(axis=1) > REACH_M - 1.5 * CELL_M).all()


def test_what_no_scan_saw_lately_is_not_there_any_more() -> None:
    gone, stays = cloud(HERE)[:60], cloud(HERE)[90:]
    map_ = map_of(gone, *[stays] * 4, kept=4)
    paired = np.empty(60, np.int64)
    looked_up(map_, np.concatenate([gone[:20], stays[:40]]), HERE[0], HERE[1], HERE[2], paired)
    assert (paired[:20] == -1).mean() > 0.9
    assert (paired[20:] >= 0).all()
    # Seen again, it is where it is seen now, not the mean of then and now.
    moved = gone.copy()
    moved[:, :2] += 0.04
    moved[:, 4:] += 0.04
    add_to_map(map_, moved, HERE, 4, True)
    looked_up(map_, moved, HERE[0], HERE[1], HERE[2], paired)
    points = carried(moved, HERE)[:, 4:]
    off = np.einsum("ka,ka->k", points - map_.points[paired, :2], map_.points[paired, 2:4])
    assert (paired >= 0).all()
    assert np.abs(off).max() < 0.03
    assert np.abs(off).mean() < 0.005


def test_maps_repeat_and_far_places_are_told_apart() -> None:
    """Two rooms so far apart that they share the raster's cells: the later one has them."""
    far = np.array([CELL_M * CELLS, 0.0, 0.0])
    map_ = map_of(cloud(HERE))
    add_to_map(map_, cloud(HERE), far + HERE, 15, True)
    pose, _, fit, _ = align_in_map(
        map_, cloud(HERE), far + HERE + np.array([0.05, 0.02, 0.01]), 0.3, NOTHING_KNOWN
    )
    assert pose == pytest.approx(far + HERE, abs=4e-3)
    assert fit[1] > 0.8 * BEAMS
    assert align_in_map(map_, cloud(HERE), HERE, 0.3, NOTHING_KNOWN)[3] == TOO_FEW


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12), st.floats(-0.06, 0.06), st.booleans())
def test_an_alignment_in_the_map_finds_what_one_with_all_points_finds(
    dx: float, dy: float, turn: float, led: bool
) -> None:
    rng = np.random.default_rng(7)
    scans = [cloud(HERE, 0.01 * rng.standard_normal(BEAMS)) for _ in range(15)]
    source, start = cloud(HERE, 0.01 * rng.standard_normal(BEAMS)), HERE + np.array([dx, dy, turn])
    map_ = map_of(*scans, led=led)
    pose, _, _, status = align_in_map(map_, source, start, 0.3, NOTHING_KNOWN)
    box, starts, _, points = sort_into_buckets(carried(np.concatenate(scans), HERE), 0.2)
    exact = align(source, start, PRIOR, 0.3, 0.2, 0.05, 25, box, starts, points)[0]
    assert status == CONVERGED
    assert np.hypot(*(pose - exact)[:2]) < 0.006
    assert abs(pose[2] - exact[2]) < 0.002
    # What was found already is not found a second time.
    again = align_in_map(map_, source, start, 0.3, pose)
    assert again[3] in {MET, CONVERGED}


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2), st.floats(-0.25, 0.25), st.floats(-0.2, 0.2))
def test_the_guess_that_is_right_wins(right: int, dx: float, turn: float) -> None:
    motion = np.array([dx, 0.05, turn])
    wrong = np.array([[1.9, 0.4, 0.9], [-1.7, -0.6, -0.9]])
    motions = np.insert(wrong, right, motion, axis=0)
    there = composed(HERE, motion)
    pose, hessian, start, told, split = placed(
        cloud(there), HERE, motions, 3, False, np.zeros((0, 3)), 0.01, 0.9, False, map_of(cloud(HERE))
    )
    assert split
    assert told[0] > 0.6
    assert np.hypot(*(pose - there)[:2]) < 0.01
    assert np.allclose(start, there, atol=0.2)
    assert np.linalg.eigvalsh(hessian)[0] > 0.0
    assert told[1] < 0.02


def test_nothing_fits_where_nothing_is() -> None:
    far = np.array([[90.0, 0.0, 0.0]])
    nothing, map_ = np.zeros((0, 3)), map_of(cloud(HERE))
    told = placed(cloud(HERE), HERE, far, 1, False, nothing, 0.01, 0.9, False, map_)[3]
    assert told[0] == -1.0


def test_the_odometry_is_believed_after_it_was_right_and_not_where_there_is_none() -> None:
    errors, velocity, step = np.array([0.5, 0.001, 0.002]), np.zeros(3), np.array([0.1, 0.0, 0.02])
    assert guessed_motions(errors, velocity, step, True, 0.2)[0][-1] == pytest.approx(step)
    for sign in (1.0, -1.0) * 150:
        learn_motion(errors, velocity, sign * step, True, sign * step, 0.2)
    motions, credible = guessed_motions(errors, velocity, step, True, 0.2)
    assert motions[0] == pytest.approx(step)
    assert credible == 1
    assert len(guessed_motions(errors, velocity, np.zeros(3), False, 0.2)[0]) == 2


def test_a_velocity_of_long_ago_is_no_guess_that_was_right() -> None:
    """Its error is that of the guess which is made of it: standing still."""
    errors, velocity, step = np.array([0.0, 0.001, 0.002]), np.zeros(3), np.array([1.0, 0.0, 0.0])
    for _ in range(100):
        learn_motion(errors, velocity, 1.1 * step, True, step, 3.5)
    motions, credible = guessed_motions(errors, velocity, 1.1 * step, True, 3.5)
    assert not motions[1:].any()
    assert credible == 1
    assert errors[1] == pytest.approx(errors[2], abs=0.01)


def test_a_robot_does_not_stand_while_its_wheels_turn() -> None:
    """Before anything was right or wrong, and until the odometry was wrong for long."""
    step = np.array([1.0, 0.0, 0.1])
    beginning = np.array([0.02, 0.001, 0.002])
    motions, credible = guessed_motions(beginning, np.zeros(3), step, True, 0.2)
    assert motions[0] == pytest.approx(step)
    assert credible == 1
    spinning = np.array([0.9, 0.001, 0.002])
    assert not guessed_motions(spinning, np.zeros(3), step, True, 0.2)[0][0].any()


def test_what_speaks_against_the_odometry() -> None:
    """Long motions may be off by more, but however bad it was none stands still of which it tells a metre."""
    stood, long = np.zeros(3), np.array([[1.0, 0.0, 0.0]])
    turned = long[0] + (0.1, 0.05, 0.2)
    assert plausibility(turned, long, 0.001, True)[0] > 1.5 * plausibility(turned, long, 0.001, False)[0]
    assert plausibility(stood, long, 0.2, True)[0] < 0.25 < 0.7 < plausibility(stood, long, 0.2, False)[0]
    short, near = np.array([[0.1, 0.0, 0.05]]), np.array([0.12, 0.0, 0.06])
    assert plausibility(near, short, 0.01, True) == plausibility(near, short, 0.01, False)


def test_bearings_are_those_of_the_exact_function() -> None:
    for angle in np.linspace(-math.pi + 1e-6, math.pi - 1e-6, 997):
        x, y = 3.0 * math.cos(angle), 3.0 * math.sin(angle)
        assert bearing_of(x, y) == pytest.approx(math.atan2(y, x), abs=1.2e-5)


def test_the_pyramid_is_that_of_the_greatest_in_each_square() -> None:
    grid = np.random.default_rng(5).random((13, 17)).astype(np.float32)
    pyramid, margin = max_pyramid(grid, 3)
    whole = pyramid[0]
    assert margin == 8
    for h in range(4):
        side = 1 << h
        for r in range(0, whole.shape[0], 3):
            for c in range(whole.shape[1]):
                assert pyramid[h, r, c] == whole[r : r + side, c : c + side].max()


def test_what_is_told_by_chance_tells_nothing() -> None:
    bare = np.diag([2.0, 100.0, 900.0])
    told = told_by(bare, 150.0)
    assert told[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert told[1, 1] == pytest.approx(100.0 - 0.03 * 150.0)
    assert told == pytest.approx(told.T)
    held = told_by(np.diag([60.0, 100.0, 900.0]), 150.0)
    assert held == pytest.approx(np.diag([55.5, 95.5, 900.0]))


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_other_readings_are_apart_from_the_scans_and_from_one_another(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scans, told = int(rng.integers(1, 6)), int(rng.integers(0, 20))
    at = np.cumsum(rng.normal(0.0, 0.1, (scans, 3)), axis=0) + np.array([0.0, 0.0, math.pi])
    readings = at[rng.integers(0, scans, told)] + rng.normal(0.0, 0.1, (told, 3))
    readings[:, 2] += math.tau * rng.integers(-1, 2, told)
    first = rng.integers(0, told + 1, scans)
    end = first + rng.integers(0, told + 1 - first)
    starts, others = distinct_readings(at, readings, first, end, 0.1)
    assert starts[0] == 0
    assert starts[-1] == len(others)

    def apart(a: FloatArray, b: FloatArray) -> float:
        return math.dist(a[:2], b[:2]) + 0.5 * abs(math.remainder(a[2] - b[2], math.tau))

    for k in range(scans):
        kept = [at[k]]
        for reading in readings[first[k] : end[k]]:
            if all(apart(reading, other) > 0.1 for other in kept):
                kept.append(reading)
        assert np.array_equal(others[starts[k] : starts[k + 1]], np.reshape(kept[1:], (-1, 3)))
    relative = between_all(at[0], others)
    assert all(np.array_equal(relative[k], between(at[0], other)) for k, other in enumerate(others))
