"""Kernels of local control: window, rollouts, time to go, matching, bands, the ground."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import ByteArray
from pilotage.kernels.control.band import path_time, speed_profile
from pilotage.kernels.control.commands_sent import drive_out, filter_rates
from pilotage.kernels.control.dynamic_window import choose_in_window, window
from pilotage.kernels.control.evasion import best_evasion
from pilotage.kernels.control.footprint import discs_clearance
from pilotage.kernels.control.ground_shown import believed, rolled
from pilotage.kernels.control.ground_update import Fan, Grids, insert_scan, sectors
from pilotage.kernels.control.heading_vector import along_arc
from pilotage.kernels.control.match import match_scan
from pilotage.kernels.control.merged_means import merged_means, without_passed
from pilotage.kernels.control.motion_limits import Drive, advance, approach, command_is_safe
from pilotage.kernels.control.rollouts import weighted_mean
from pilotage.kernels.control.scan_ends import cleaned_ranges, evenly_spaced
from pilotage.kernels.control.togo import UNREACHED_S, descent_path, time_to_go
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.grids.distance import nearest_marked
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.stack.control.local.body import dense_m, make_body
from support.seen_ground import DRIVE, JACKAL, ground_of

NOBODY = np.zeros((1, 0, 3))
SPEED = st.floats(-0.5, 2.0)
TURN = st.floats(-4.0, 4.0)


@pytest.mark.parametrize(
    ("told", "ranges", "silent"),
    [
        ([1.0, math.nan, math.inf, 0.0, 7.0], [1.0, 0.0, 5.0, 0.0, 7.0], 1),
        ([math.nan, math.nan], [0.0, 0.0], 2),
    ],
)
def test_a_beam_that_measured_nothing_passed_through_nothing(
    told: list[float], ranges: list[float], silent: int
) -> None:
    """The ground along it counted as seen, and free."""
    cleaned, found = cleaned_ranges(np.array(told), 5.0)
    assert (cleaned.tolist(), found) == (ranges, silent)


@pytest.mark.parametrize(("rows", "columns"), [(0, 3), (2, -1), (-5, 4), (9, 0)])
def test_what_is_known_moves_with_the_window(rows: int, columns: int) -> None:
    """Hits with their means and seen cells lie where they did; what comes in is empty."""
    rng = np.random.default_rng(4)
    m, n = 8, 16
    hits = rng.integers(0, 3, (n, n)).astype(np.uint8)
    mean, seen = rng.normal(size=(n * n, 2)), rng.random((m, m)) < 0.5
    before = hits.copy(), mean.copy(), seen.copy()
    rolled(hits, mean, seen, rows, columns)
    for r, c in np.ndindex(n, n):
        was_r, was_c = r + 2 * rows, c + 2 * columns
        held = int(before[0][was_r, was_c]) if 0 <= was_r < n and 0 <= was_c < n else 0
        assert hits[r, c] == held
        if held:
            assert (mean[r * n + c] == before[1][was_r * n + was_c]).all()
    for r, c in np.ndindex(m, m):
        inside = 0 <= r + rows < m and 0 <= c + columns < m
        assert seen[r, c] == (inside and before[2][r + rows, c + columns])


@pytest.mark.parametrize(("beams", "view_rad"), [(37, 1.0), (181, 4.7), (720, 2.0 * math.pi), (4, 6.2)])
def test_sectors_leave_out_only_what_no_beam_reaches(beams: int, view_rad: float) -> None:
    """Cells are cleared and seen as they are where every cell is held against its own beams."""
    rng = np.random.default_rng(beams)
    step = view_rad / (beams - 1)
    culled = sectors(beams, step)
    every = np.array([np.zeros(culled.shape[1]), np.full(culled.shape[1], beams - 1)], dtype=np.int64)
    body = make_body(np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]]))
    for _ in range(5):
        hits = rng.integers(0, 8, (60, 60)).astype(np.uint8)
        mean = np.stack(np.meshgrid(np.arange(60.0), np.arange(60.0)), axis=-1).reshape(-1, 2) * 0.1 - 2.95
        seen = np.zeros((30, 30), np.bool_)
        pose = rng.uniform(-1.0, 1.0, 3) * [1.0, 1.0, math.pi]
        ranges = rng.uniform(0.1, 4.0, beams)
        outcomes = []
        for of_sectors in (culled, every):
            left, known = hits.copy(), seen.copy()
            mount, points, first = np.array([0.1, 0.05, 0.4]), np.zeros((0, 2)), -0.5 * view_rad
            grids, fan = Grids(left, mean, known, -3.0, -3.0, 0.1), Fan(ranges, first, step, 9.0, of_sectors)
            insert_scan(grids, fan, pose, mount, 4.0, 9.0, points, body.polygon, 0.05, 3)
            outcomes.append((left, known))
        assert (outcomes[0][0] == outcomes[1][0]).all()
        assert (outcomes[0][1] == outcomes[1][1]).all()
        assert (outcomes[0][0] < hits).any()
        assert outcomes[0][1].any()


def test_ground_between_beams_that_an_obstacle_fits_between_was_not_seen() -> None:
    """Three beams showed a room as empty as far as they reached."""
    cell, n = 0.1, 100
    hits, mean = np.zeros((n, n), np.uint8), np.zeros((n * n, 2))
    still, body, step = np.zeros(3), make_body(JACKAL), 0.8
    seen = np.zeros((n // 2, n // 2), np.bool_)
    grids = Grids(hits, mean, seen, -5.0, -5.0, cell)
    fan = Fan(np.full(3, 4.0), -step, step, 9.0, sectors(3, step))
    insert_scan(grids, fan, still, still, 4.0, dense_m(0.5, step), np.zeros((0, 2)), body.polygon, 0.05, 3)
    rows, columns = np.nonzero(seen)
    away_m = np.hypot(-5.0 + 2.0 * cell * (rows + 0.5), -5.0 + 2.0 * cell * (columns + 0.5))
    assert 0.7 < away_m.max() <= dense_m(0.5, step) == pytest.approx(1.0 / math.tan(step))
    assert dense_m(0.5, 0.5 * math.pi) == dense_m(0.5, 0.0) == 0.0


def test_beams_are_evenly_spaced_or_not() -> None:
    even = np.linspace(-2.0, 2.0, 50)
    assert evenly_spaced(even)
    assert not evenly_spaced(even[::-1].copy())
    assert not evenly_spaced(np.zeros(3))
    even[20] += 1e-3
    assert not evenly_spaced(even)


@given(st.lists(st.tuples(st.integers(0, 14), st.integers(0, 11)), max_size=12))
def test_nearest_cell_is_the_nearest(marked: list[tuple[int, int]]) -> None:
    grid = np.zeros((15, 12), dtype=np.bool_)
    for row, column in marked:
        grid[row, column] = True
    _, found = nearest_marked(grid)
    rows, columns = np.nonzero(grid)
    for row in range(15):
        for column in range(12):
            if not rows.size:
                assert found[row, column] == -1
                continue
            at = found[row, column]
            mine = (at // 12 - row) ** 2 + (at % 12 - column) ** 2
            assert grid[at // 12, at % 12]
            assert mine == ((rows - row) ** 2 + (columns - column) ** 2).min()


@given(st.floats(-3.0, 3.0), st.lists(st.tuples(st.floats(-0.4, 0.4), st.floats(-1.2, 1.2)), max_size=30))
def test_a_turned_unit_vector_is_the_heading(theta: float, arcs: list[tuple[float, float]]) -> None:
    """Piece after piece the same arc as with sines and cosines, also beyond small angles."""
    x, y, heading = 0.3, -0.2, theta
    at = (x, y, math.cos(theta), math.sin(theta))
    for distance, angle in arcs:
        x, y, heading = exact_arc(x, y, heading, distance, angle)
        at = along_arc(*at, distance, angle)
    assert at == pytest.approx((x, y, math.cos(heading), math.sin(heading)), abs=1e-13)


@given(SPEED, SPEED, st.floats(0.01, 0.5))
def test_a_rate_approaches_and_never_passes(value: float, wanted: float, dt: float) -> None:
    after = approach(value, wanted, 3.0 * dt, 2.0 * dt)
    assert min(value, wanted) <= after <= max(value, wanted)
    assert abs(after - value) <= 3.0 * dt + 1e-12


@given(SPEED, TURN, st.floats(0.02, 0.4))
def test_the_window_holds_what_can_be_reached(v: float, w: float, dt: float) -> None:
    low_v, high_v, low_w, high_w = window(v, w, dt, DRIVE)
    for cv in (-9.0, 0.0, 9.0):
        for cw in (-9.0, 0.0, 9.0):
            _, _, _, nv, nw = advance(0.0, 0.0, 0.0, v, w, cv, cw, dt, DRIVE)
            assert low_v - 1e-9 <= nv <= high_v + 1e-9
            assert low_w - 1e-9 <= nw <= high_w + 1e-9


@given(
    SPEED,
    TURN,
    st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), max_size=20),
)
def test_dwa_never_leaves_its_window(v: float, w: float, places: list[tuple[float, float]]) -> None:
    points = np.array([p for p in places if math.hypot(*p) > 0.5]).reshape(-1, 2)
    ground = ground_of(points)
    start = np.array([0.0, 0.0, 0.2, v, w])
    cv, cw, _ = choose_in_window(
        start, 0.2, 1.0, 5, 7, DRIVE, make_body(JACKAL), ground, 0.03, 0.2, 1.0, 0.3, 0.2
    )
    low_v, high_v, low_w, high_w = window(v, w, 0.2, DRIVE)
    assert low_v - 1e-9 <= cv <= high_v + 1e-9
    assert low_w - 1e-9 <= cw <= high_w + 1e-9


@given(st.floats(0.2, 2.0), st.floats(-1.5, 1.5), st.integers(0, 10_000))
def test_a_command_called_safe_can_be_braked_from(v: float, w: float, seed: int) -> None:
    """Driven out finely with the worse limits, the manoeuvre touches no point."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2.0, 2.0, (25, 2))
    points = points[np.hypot(points[:, 0], points[:, 1]) > 0.45]
    ground = ground_of(points)
    kept = ground.mean[ground.hits.reshape(-1) > 0]
    body = make_body(JACKAL)
    worse = DRIVE.scaled(0.7)
    start = np.array([0.0, 0.0, 0.0, v, w])
    safe, _ = command_is_safe(
        start, v, w, 0.1, 0.05, True, DRIVE, worse, body, ground, NOBODY, 0.03, 0.0, 0.05
    )
    if not safe:
        return
    posts = np.insert(kept, 2, 0.0, axis=1)
    for limits in (DRIVE, worse):
        x, y, theta, nv, nw = start
        for k in range(2000):
            slower = approach(nv, 0.0, 0.0, limits.deceleration * 0.01)
            cv, cw = (v, w) if k < 10 else (0.0, w / v * slower)
            x, y, theta, nv, nw = advance(x, y, theta, nv, nw, cv, cw, 0.01, limits)
            assert discs_clearance(x, y, theta, JACKAL, posts) > 0.0
            if nv == 0.0:
                break


def test_weighted_mean_goes_to_the_cheapest_as_the_temperature_falls() -> None:
    rng = np.random.default_rng(5)
    commands = rng.normal(size=(50, 8, 2))
    costs = rng.uniform(1.0, 5.0, 50)
    cold = weighted_mean(commands, costs, 1e-4)
    assert np.allclose(cold, commands[int(np.argmin(costs))])
    warm = weighted_mean(commands, costs, 1e6)
    assert np.allclose(warm, commands.mean(axis=0), atol=1e-4)


def test_time_to_go_is_the_distance_in_the_open_and_goes_around_walls() -> None:
    m = 60
    speed = np.full((m, m), 2.0)
    field = time_to_go(speed, 0.0, 0.0, 0.1, 3.05, 3.05, 2.0, 0.0, 0.0, 1e9)
    rows, columns = np.indices((m, m))
    straight = np.hypot(0.1 * columns + 0.05 - 3.05, 0.1 * rows + 0.05 - 3.05) / 2.0
    assert np.all(field >= straight - 1e-9)
    assert np.all(field <= 1.03 * straight + 0.02)
    speed[30, :50] = 0.0
    wall = time_to_go(speed, 0.0, 0.0, 0.1, 1.05, 5.05, 2.0, 0.0, 0.0, 1e9)
    assert wall[10, 10] > 1.2 * (4.0 / 2.0)
    path = descent_path(1.05, 1.05, wall, 0.0, 0.0, 0.1, 0.1, 200)
    assert math.hypot(path[-1, 0] - 1.05, path[-1, 1] - 5.05) < 0.6
    speed[30, :] = 0.0
    closed = time_to_go(speed, 0.0, 0.0, 0.1, 1.05, 5.05, 2.0, 0.0, 0.0, 1e9)
    assert closed[10, 10] == UNREACHED_S


@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.04, 0.04))
def test_matching_finds_a_small_displacement(dx: float, dy: float, turn: float) -> None:
    rng = np.random.default_rng(11)
    points = rng.uniform(-3.0, 3.0, (120, 2))
    ground = ground_of(points)
    kept = ground.mean[ground.hits.reshape(-1) > 0]
    c, s = math.cos(turn), math.sin(turn)
    # What a robot at (dx, dy, turn) sees of them, in its own frame.
    seen = np.ascontiguousarray((kept - [dx, dy]) @ np.array([[c, -s], [s, c]]))
    std = np.array([0.1, 0.1, 0.1])
    x, y, theta, partners = match_scan(0.0, 0.0, 0.0, seen, 1, ground, 0.3, 0.02, std, 0.0)
    assert partners > 50
    assert math.hypot(x - dx, y - dy) < 0.02
    assert abs(theta - turn) < 0.01


def test_matching_leaves_the_odometry_alone_without_partners() -> None:
    ground = ground_of(np.array([[3.0, 3.0]]))
    seen = np.random.default_rng(1).uniform(-2.0, 0.0, (50, 2))
    pose = match_scan(0.1, 0.2, 0.3, seen, 1, ground, 0.2, 0.05, np.full(3, 0.1), 0.0)
    assert pose[:3] == (0.1, 0.2, 0.3)


@given(st.floats(0.0, 2.0), st.integers(0, 1000))
def test_a_speed_profile_keeps_its_limits(v_now: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.uniform(0.02, 0.2, (30, 2)), axis=0)
    caps = rng.uniform(0.3, 2.0, 30)
    speeds = speed_profile(path, v_now, 0.0, caps, DRIVE)
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert np.all(speeds <= caps + 1e-9)
    squares = np.diff(speeds**2)
    assert np.all(squares <= 2.0 * DRIVE.acceleration * steps + 1e-9)
    assert np.all(squares >= -2.0 * DRIVE.deceleration * steps - 1e-9)
    assert path_time(path, speeds) >= steps.sum() / DRIVE.speed


def test_commands_under_way_are_driven_out_in_their_order() -> None:
    sent = np.array([[0.0, 1.0, 0.0], [0.1, 0.0, 0.0]])
    state = np.array([0.0, 0.0, 0.0, 0.0, 0.0])
    out = drive_out(state, 0.1, 0.2, 0.1, sent, DRIVE)
    assert out[3] == pytest.approx(0.3)
    assert drive_out(state, 0.1, 0.6, 0.1, sent, DRIVE)[3] == 0.0


def _filtered(
    true: Drive, noise: tuple[float, float], steps: int, hypotheses: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """True and measured rates (N, 2), those of each hypothesis (N, H, 2), and its errors (N, H)."""
    rng = np.random.default_rng(4)
    bank = np.zeros((len(hypotheses), 6))
    rates = np.zeros((steps, 2))
    measured, filtered = np.zeros((steps, 2)), np.zeros((steps, len(hypotheses), 2))
    errors = np.zeros((steps, len(hypotheses)))
    state = np.zeros(5)
    for k in range(steps):
        t = 0.05 * k
        sent = np.array([[t - 0.05, *((2.0, 1.5) if k // 20 % 2 else (0.3, -1.5))]])
        state = drive_out(state, t - 0.05, t, 0.0, sent, true)
        rates[k] = state[3:]
        measured[k] = state[3:] + rng.normal(0.0, 1.0, 2) * noise
        errors[k] = filter_rates(
            bank, measured[k], np.square(noise), t - 0.05, t, 0.0, sent, DRIVE, hypotheses,
            np.array([0.03, 0.06]),
        )  # fmt: skip
        filtered[k] = bank[:, :2]
    return rates, measured, filtered, errors


def test_the_true_limits_explain_the_answers_best() -> None:
    hypotheses = np.array([[1.0, 1.0], [0.7, 1.0], [0.5, 1.0]])
    *_, errors = _filtered(DRIVE.scaled(0.7), (0.1, 0.1), 100, hypotheses)
    assert int(np.argmin(errors.sum(axis=0))) == 1


def test_rates_are_known_better_than_noisy_odometry_measures_them() -> None:
    """A quarter of a metre a second is the noise of odometry four times as bad as usual, at 20 Hz."""
    rates, measured, filtered, _ = _filtered(DRIVE, (0.25, 0.25), 400, np.array([[1.0, 1.0]]))
    assert (filtered[:, 0] - rates).std(axis=0).max() < 0.45 * (measured - rates).std(axis=0).min()


def test_a_top_speed_that_is_not_reached_is_measured_all_the_same() -> None:
    """No hypothesis names it: what is wrong the same way for long gives way to the measurements."""
    slower = DRIVE._replace(speed=1.2)
    rates, _, filtered, _ = _filtered(slower, (0.06, 0.06), 400, np.array([[1.0, 1.0]]))
    fast = rates[:, 0] > 1.19
    assert (filtered[fast, 0, 0] - rates[fast, 0]).mean() < 0.1


def test_the_best_evasion_goes_around_what_it_cannot_brake_for() -> None:
    start = np.array([0.0, 0.0, 0.0, 1.5, 0.0])
    slow = DRIVE._replace(deceleration=1.0, acceleration=1.0)
    commands = np.array([[0.0, 0.0, 0.1], [0.0, -2.0, 0.4], [0.0, 2.0, 0.4], [1.5, 0.0, 0.4]])
    fixed = commands, 0.05, slow, slow.scaled(0.8), make_body(JACKAL)
    best, score = best_evasion(start, *fixed, ground_of(np.array([[0.9, -0.1]])))
    assert best == 2
    assert score > 0.0
    # Between walls nothing is left but to brake, into what it meets then most slowly.
    x = np.arange(-1.0, 2.0, 0.05)
    walls = [np.column_stack([x, np.full(x.shape, y)]) for y in (-0.3, 0.3)]
    best, score = best_evasion(start, *fixed, ground_of(np.vstack([[[0.9, -0.1]], *walls])))
    assert best == 0
    assert -3.0 < score < 0.0


@pytest.mark.parametrize(("off", "kept"), [(0.5, True), (0.3, True), (0.0, False)])
def test_what_one_beam_hit_is_gone_once_a_beam_leads_through_it(off: float, kept: bool) -> None:
    """The end of a wall, hit by one beam of ninety, was forgotten as two passed it to either side."""
    cell, n, beams = 0.05, 60, 90
    step = 2.0 * math.pi / beams
    hits, mean, seen = np.zeros((n, n), np.uint8), np.zeros((n * n, 2)), np.zeros((n // 2, n // 2), np.bool_)
    grids, body, still = Grids(hits, mean, seen, -1.5, -1.5, cell), make_body(JACKAL), np.zeros(3)
    ranges = np.full(beams, 3.0)
    ranges[beams // 2] = 0.8
    end_m = np.array([[0.8, 0.0]])
    fan = Fan(ranges, -math.pi, step, 9.0, sectors(beams, step))
    insert_scan(grids, fan, still, still, 4.0, 9.0, end_m, body.polygon, 0.05, 3)
    assert np.count_nonzero(hits) == 1
    nothing, turned = (
        Fan(np.full(beams, 3.0), -math.pi, step, 9.0, fan.of_sectors),
        np.array([0.0, 0.0, off * step]),
    )
    insert_scan(grids, nothing, turned, still, 4.0, 9.0, np.zeros((0, 2)), body.polygon, 0.05, 3)
    assert np.count_nonzero(hits) == int(kept)


def _stared_at(depth_m: float, seconds: float) -> tuple[ByteArray, FloatArray]:
    """Hits and means after looking at a wall, noise 1 cm, its surface ``depth_m`` into a cell."""
    rng = np.random.default_rng(3)
    n, cell, beams = 60, 0.05, 61
    hits, mean, seen = np.zeros((n, n), np.uint8), np.zeros((n * n, 2)), np.zeros((n // 2, n // 2), np.bool_)
    angles = np.linspace(-0.3, 0.3, beams)
    step = float(angles[1] - angles[0])
    body = make_body(JACKAL)
    still = np.zeros(3)
    grids = Grids(hits, mean, seen, -1.5, -1.5, cell)
    for _ in range(round(seconds / 0.05)):
        ranges = (1.0 + depth_m) / np.cos(angles) + rng.normal(0.0, 0.01, beams)
        points = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        fan = Fan(ranges, float(angles[0]), step, 9.0, sectors(beams, step))
        insert_scan(grids, fan, still, still, 4.0, 9.0, points, body.polygon, 0.05, 3)
    return believed(hits), mean


def test_noise_in_front_of_a_wall_is_not_believed_however_long_it_is_looked_at() -> None:
    """One beam in forty ends in the cell before the wall's; counts that only fill up made it an obstacle."""
    hits, mean = _stared_at(0.02, 60.0)
    assert mean[np.flatnonzero(hits), 0].min() > 1.01
    assert np.count_nonzero(hits) >= 8


def test_merged_means_lie_on_the_wall_that_cells_cut_in_two() -> None:
    """At a cell's border halves of the noise are 8 mm before and behind; together they are on it."""
    hits, mean = _stared_at(0.0, 5.0)
    marked = np.flatnonzero(hits)
    assert np.abs(mean[marked, 0] - 1.0).max() > 0.006
    assert np.abs(merged_means(hits, mean, 0.03)[marked, 0] - 1.0).max() < 0.004


def test_a_scan_from_nearby_takes_away_what_it_looks_past_and_nothing_else() -> None:
    """Gone is what stood 6 cm beside the end of a wall as seen from afar; what is there stays, in noise."""
    walls = np.array([[0.8, -2.0, 0.8, -0.24], [0.8, 0.24, 0.8, 2.0], [1.6, -2.0, 1.6, 2.0]])
    posts = np.array([[0.9, 0.5, 0.06]])
    angles = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 720)
    step = float(angles[1] - angles[0])
    y = np.concatenate([np.arange(-1.0, -0.23, 0.04), np.arange(0.24, 1.0, 0.04)])
    there = np.column_stack([np.full(y.shape, 0.8), y])
    false = np.array([[0.8, 0.18], [0.83, -0.16], [0.78, 0.0]])
    ground = ground_of(np.vstack([there, false]))
    rng = np.random.default_rng(7)
    for _ in range(50):
        ranges = fan_ranges(0.12, 0.0, float(angles[0]), step, 720, 20.0, walls, posts)
        ranges = ranges + rng.normal(0.0, 0.01, 720)
        seen = ranges < 19.0
        points = np.column_stack([np.cos(angles), np.sin(angles)])[seen] * ranges[seen, None] + [0.12, 0.0]
        left = without_passed(ground.hits, ground.mean, points, 0.12, 0.0, 1.2, 0.015, 0.04)
        gone = ground.mean[np.flatnonzero((ground.hits > 0) & (left == 0))]
        assert {tuple(p) for p in gone.round(3)} == {tuple(p) for p in false}
