"""Sweeps changed at random: what changes cost, what they leave, and where they may lead."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol.passes import (
    Ground,
    count_along,
    left_in_blocks,
    most_swept,
    runs_of_change,
    settle,
)
from pilotage.kernels.patrol.reshape import is_free, reshape, straightened, turns_along
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.world_map import WorldMap
from pilotage.stack.planning import sweep_changes
from pilotage.stack.planning.node_search import line_length_m
from pilotage.stack.planning.sweep_changes import subdivided
from pilotage.stack.planning.sweep_floor import Sought

CELL_M, SHAPE, WIDTH_M = 0.04, (160, 260), 0.5
NO_LEGS = np.zeros((0, 4))


def ground_of(path: FloatArray, must: BoolArray, free: BoolArray | None = None) -> Ground:
    """Cells that a path has to sweep, with its counts."""
    grid = 0.0, 0.0, CELL_M
    kinds, counts = np.where(must, np.uint8(2), np.uint8(0)), np.zeros(SHAPE, np.int16)
    prices = 0.0, 0.0, 60.0 * CELL_M**2 / WIDTH_M
    paths = np.ones(SHAPE, np.bool_) if free is None else free
    ground = WIDTH_M, grid, kinds, prices, counts, grid, paths, left_in_blocks(kinds, counts)
    count_along(path, ground)
    return ground


def recount(old: FloatArray, new: FloatArray, settled: bool, ground: Ground) -> float:
    """What more is left with some legs in the place of others; the ground counts them if it is settled."""
    more, runs = runs_of_change(old, new, math.inf, ground)
    if settled:
        settle(runs, ground)
    return more


def reshaped(path: FloatArray, ground: Ground, tries: int, turn: float = 0.0) -> FloatArray:
    room = np.zeros((3 * len(path), 2))
    room[: len(path)] = path
    draws = np.random.default_rng(3).random((tries, 6))
    return room[: reshape(room, len(path), draws, (0.05, 0.0005), turn, ground)]


def test_a_hall_of_4000_m2_is_given_as_many_changes_a_width_as_a_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of 2,400 m² two million left 2,497 right angles where as many as of a room leave 1,833."""
    tried: list[int] = []

    def counts(_path: FloatArray, size: int, draws: FloatArray, *_: object) -> int:
        tried.append(len(draws))
        return size

    monkeypatch.setattr(sweep_changes, "reshape", counts)
    bounds_m = 0.0, 0.0, 10.0, 8.0
    walls = SegmentMap(box_segments(5.0, 4.0, 10.0, 8.0, 0.0), np.zeros((0, 3)), bounds_m)
    world = WorldMap("room", bounds_m, geometry=walls)
    floor = Floor.of(world, 0.4, 0.05, (1.0, 1.0))
    sought = Sought(floor, floor, floor.reachable, np.zeros_like(floor.reachable), 0.8)
    there_and_back = np.array([[1.0, 1.0], [9.0, 1.0]] * 400)
    sweep_changes.reshaped(world.field, sought, there_and_back)
    widths = line_length_m(there_and_back) / 0.8
    assert sum(tried) >= 0.99 * sweep_changes.TRIES_A_WIDTH * widths


def test_the_cells_that_a_leg_sweeps_are_those_near_to_it() -> None:
    rng = np.random.default_rng(4)
    legs = [*rng.uniform(-0.5, 7.0, (30, 4)), [1.0, 1.0, 1.0, 1.0], [1, 2, 4, 2], [3, 1, 3, 5]]
    for leg in np.array(legs):
        path, near = leg.reshape(2, 2), np.zeros(SHAPE, np.bool_)
        ground = ground_of(path, np.ones(SHAPE, np.bool_))
        mark_swept(path, 0.5 * WIDTH_M, 0.0, 0.0, CELL_M, near)
        # On the very rim rounding decides.
        counts = ground[4]
        assert np.count_nonzero((counts == 1) != near) <= 4
        lost = 60.0 * CELL_M**2 / WIDTH_M * np.count_nonzero(counts)
        assert recount(leg[None], NO_LEGS, False, ground) == pytest.approx(lost)
        assert counts.any() or lost == 0.0
        assert recount(leg[None], NO_LEGS, True, ground) == pytest.approx(lost)
        assert not counts.any()


def test_what_changes_is_counted_as_if_all_were_counted_anew() -> None:
    """Some legs of a path take the place of others; the price is that of the cells that are left then."""
    rng = np.random.default_rng(6)
    must = rng.random(SHAPE) < 0.7
    for number in range(40):
        others, old, new = (rng.uniform(-0.3, 6.7, (rng.integers(0, 4), 4)) for _ in range(3))
        # Most changes move one end of a leg by little.
        new = np.vstack([new, old + rng.normal(0.0, 0.1, old.shape) * [1, 1, 0, 0]])
        grounds = [ground_of(np.zeros((1, 2)), must) for _ in range(2)]
        recount(NO_LEGS, np.vstack([others, old]), True, grounds[0])
        recount(NO_LEGS, np.vstack([others, new]), True, grounds[1])
        left = [np.count_nonzero(must & (ground[4] == 0)) * ground[3][2] for ground in grounds]
        before = grounds[0][4].copy()
        assert recount(old, new, False, grounds[0]) == pytest.approx(left[1] - left[0]), number
        assert (grounds[0][4] == before).all()
        assert recount(old, new, True, grounds[0]) == pytest.approx(left[1] - left[0])
        assert (grounds[0][4] == grounds[1][4]).all()
        for _, _, kinds, _, counts, _, _, kept in grounds:
            assert (kept == left_in_blocks(kinds, counts)).all()


def test_changes_that_lose_too_much_are_not_looked_at_to_the_end() -> None:
    """What is found up to there is too much already; what legs sweep at most is no less than what they do."""
    rng = np.random.default_rng(7)
    must, cut = rng.random(SHAPE) < 0.7, 0
    for _ in range(40):
        others, old, new = (rng.uniform(-0.3, 6.7, (number, 4)) for number in (20, 2, 1))
        ground = ground_of(np.zeros((1, 2)), must)
        recount(NO_LEGS, np.vstack([others, old]), True, ground)
        best = most_swept(new, ground)
        assert best >= -recount(NO_LEGS, new, False, ground) - 1e-9
        more, runs = runs_of_change(old, new, math.inf, ground)
        for bar in (0.1, 1.0, 3.0):
            found, some = runs_of_change(old, new, bar + best, ground)
            assert (found > bar) == (more > bar)
            assert found == pytest.approx(more) or len(some) < len(runs)
            cut += len(some) < len(runs)
    assert cut > 10


def test_a_path_is_changed_to_what_it_needs_and_leaves_nothing_out() -> None:
    """Lines across a room, a way back along their ends, and a detour to where they were."""
    lines = [[1.0 + 8.0 * (k % 4 in (1, 2)), 1.0 + 0.5 * (k // 2)] for k in range(20)]
    corners = np.array([[1.0, 1.0], *lines, [9.0, 5.5], [4.0, 5.0], [9.0, 5.5], [9.0, 1.0], [1.0, 1.0]])
    path = subdivided(corners, WIDTH_M)
    assert np.hypot(*np.diff(path, axis=0).T).max() <= WIDTH_M + 1e-9
    must, after = np.zeros(SHAPE, np.bool_), np.zeros(SHAPE, np.bool_)
    mark_swept(path, 0.5 * WIDTH_M, 0.0, 0.0, CELL_M, must)
    ground = ground_of(path, must)
    short = reshaped(path, ground, 60_000)
    assert (short[[0, -1]] == path[[0, -1]]).all()
    mark_swept(np.ascontiguousarray(short), 0.5 * WIDTH_M, 0.0, 0.0, CELL_M, after)
    assert np.count_nonzero(must & ~after) <= 2
    # What it counts on the way is what there is in the end.
    assert (ground_of(short, must)[4] == ground[4]).all()
    lengths = [np.hypot(*np.diff(line, axis=0).T).sum() for line in (path, short)]
    # The detour is 10 m of it; the way back sweeps half a metre of each second pair of lines' ends.
    assert lengths[1] < lengths[0] - 12.0


@pytest.mark.parametrize("seed", range(6))
def test_changes_cost_what_they_turn(seed: int) -> None:
    """Without heat its length and what it turns never grow together: changes count it as it is."""
    rng = np.random.default_rng(seed)
    corners = np.cumsum(rng.uniform(-0.8, 0.8, (8, 2)), axis=0) % 4.0 + 1.0
    path = subdivided(corners, WIDTH_M)
    ground = ground_of(path, np.zeros(SHAPE, np.bool_))
    room = np.zeros((3 * len(path), 2))
    room[: len(path)] = path

    def cost(line: FloatArray) -> float:
        return line_length_m(line) + 0.3 * turns_along(line)

    size, paid, changes = len(path), cost(path), 0
    for draws in rng.random((4000, 1, 6)):
        before = room[:size].copy()
        size = reshape(room, size, draws, (1e-9, 1e-9), 0.3, ground)
        now = room[:size].copy()
        changes += not np.array_equal(before, now)
        assert cost(now) <= paid + 1e-6
        paid = cost(now)
    assert changes > 10
    assert turns_along(now) < 0.5 * turns_along(path)


def test_nothing_is_driven_through_a_wall() -> None:
    path = subdivided(np.array([[1.0, 1.0], [1.0, 3.0], [1.4, 3.0], [1.4, 1.0]]), 0.25)
    free = np.ones(SHAPE, np.bool_)
    free[:60, 30] = False
    short = reshaped(path, ground_of(path, np.zeros(SHAPE, np.bool_), free), 20_000)
    grid = 0.0, 0.0, CELL_M
    assert all(is_free(a, b, free, grid) for a, b in itertools.pairwise(short))
    assert short[:, 1].max() > 2.3
    assert np.hypot(*np.diff(short, axis=0).T).sum() < 3.2


def test_a_line_takes_the_place_of_vertices_beside_it_where_it_is_free() -> None:
    path = np.array([[1, 1], [2, 1.01], [3, 1], [4, 1.2], [5, 1], [5, 3], [5.02, 2], [5, 4]], dtype=float)
    open_floor = ground_of(path, np.zeros(SHAPE, np.bool_))
    assert straightened(path, 0.05, open_floor).tolist() == path[[0, 2, 3, 4, 5, 6, 7]].tolist()
    free = np.ones(SHAPE, np.bool_)
    free[25, 35] = False  # on the straight line, below the first bend
    straight = straightened(np.array([[1, 1.02], [1.4, 1.07], [2, 1.02]]), 0.1, ground_of(path, ~free, free))
    assert len(straight) == 3
