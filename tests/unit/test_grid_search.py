"""Search on grids: optimal against a plain Dijkstra, legal steps, exact arithmetic, components."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy import ndimage

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.grids import components as grid_components
from pilotage.kernels.grids import distance as grid_distance
from pilotage.kernels.grids import moves as grid_moves
from pilotage.kernels.grids import search as grid_search
from pilotage.stack.planning.grid_space import Cell, GridPath, GridSpace, Search

SHAPES = array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=14)
OPEN_OR_DENSE = st.sampled_from([0.1, 0.25, 0.4, 0.5])


@st.composite
def masks(draw: st.DrawFn) -> BoolArray:
    """Random obstacles with a free start and goal in two corners or anywhere."""
    shape = draw(SHAPES)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return np.asarray(rng.random(shape) < draw(OPEN_OR_DENSE))


@st.composite
def problems(draw: st.DrawFn) -> tuple[BoolArray, Cell, Cell]:
    mask = draw(masks()).copy()
    ends = [(draw(st.integers(0, mask.shape[0] - 1)), draw(st.integers(0, mask.shape[1] - 1))) for _ in "ab"]
    for end in ends:
        mask[end] = False
    return mask, ends[0], ends[1]


def steps(mask: BoolArray, cell: Cell, cut: bool) -> Iterator[Cell]:
    """Where a step leads to, by the definition."""
    rows, columns = mask.shape

    def free(r: int, c: int) -> bool:
        return 0 <= r < rows and 0 <= c < columns and not mask[r, c]

    r, c = cell
    for dr in (-1, 0, 1):
        for dc in (-1, 0, 1):
            straight_on = free(r + dr, c + dc) and (dr, dc) != (0, 0)
            if straight_on and (cut or not dr or not dc or (free(r + dr, c) and free(r, c + dc))):
                yield r + dr, c + dc


def reference(
    mask: BoolArray, start: Cell, goal: Cell, cut: bool, factors: FloatArray | None = None
) -> float:
    """Dijkstra in floats."""
    cost = {start: 0.0}
    queue = [(0.0, start)]
    while queue:
        here, cell = heapq.heappop(queue)
        if cell == goal:
            return here
        if here > cost[cell]:
            continue
        for to in steps(mask, cell, cut):
            factor = 1.0 if factors is None else 0.5 * float(factors[cell] + factors[to])
            new = here + factor * math.dist(cell, to)
            if new < cost.get(to, math.inf):
                cost[to] = new
                heapq.heappush(queue, (new, to))
    return math.inf


def assert_legal(mask: BoolArray, path: GridPath, start: Cell, goal: Cell, cut: bool) -> None:
    cells = [(int(r), int(c)) for r, c in path.cells]
    assert cells[0] == start
    assert cells[-1] == goal
    for a, b in itertools.pairwise(cells):
        assert b in set(steps(mask, a, cut))


@given(problems(), st.booleans(), st.sampled_from(Search))
@settings(max_examples=300, deadline=None)
def test_paths_are_optimal_and_legal(
    problem: tuple[BoolArray, Cell, Cell], cut: bool, search: Search
) -> None:
    mask, start, goal = problem
    best = reference(mask, start, goal, cut)
    path = GridSpace(mask).shortest(start, goal, cut, search)
    if path is None:
        assert math.isinf(best)
        return
    assert path.length_cells == pytest.approx(best, abs=1e-9)
    assert path.cost == path.length_cells
    assert_legal(mask, path, start, goal, cut)


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=150, deadline=None)
def test_jumps_find_what_cells_find(seed: int, cut: bool) -> None:
    """On grids wider and higher than a word of bits, of rubble and of blocks, both ways."""
    rng = np.random.default_rng(seed)
    mask = rng.random(tuple(rng.integers(1, 220, 2))) < rng.choice([0.0, 0.003, 0.02, 0.2, 0.4])
    if rng.random() < 0.5:
        mask = ndimage.binary_dilation(mask, iterations=int(rng.integers(1, 4)))
    free = np.argwhere(~mask)
    if len(free) < 2:
        return
    space = GridSpace(mask)
    for _ in range(4):
        start, goal = ((int(r), int(c)) for r, c in free[rng.choice(len(free), 2, replace=False)])
        jumped = space.shortest(start, goal, cut, Search.JUMPS, tell_looked_at=True)
        stepped = space.shortest(start, goal, cut, Search.CELLS)
        assert (jumped is None) == (stepped is None)
        if jumped is None or stepped is None:
            continue
        assert jumped.length_cells == pytest.approx(stepped.length_cells, abs=1e-9)
        assert_legal(mask, jumped, start, goal, cut)
        assert not mask.ravel()[jumped.looked_at].any()


def test_jumps_in_wide_arithmetic() -> None:
    """A serpentine that outgrows 32 bits takes the second scale."""
    mask = np.zeros((2001, 60), dtype=np.bool_)
    mask[1::4, :-1] = True
    mask[3::4, 1:] = True
    mask = np.repeat(mask, 2, axis=1)
    space = GridSpace(mask)
    jumped = space.shortest((0, 0), (2000, 0), search=Search.JUMPS)
    stepped = space.shortest((0, 0), (2000, 0), search=Search.CELLS)
    assert jumped is not None
    assert stepped is not None
    assert stepped.length_cells > grid_search.NARROW.straight * math.sqrt(2.0)
    assert jumped.length_cells == stepped.length_cells


def test_no_jumps_where_cells_differ_in_cost() -> None:
    space = GridSpace(np.zeros((3, 3), np.bool_), np.ones((3, 3)))
    with pytest.raises(InputError, match="without cell costs"):
        space.shortest((0, 0), (2, 2), search=Search.JUMPS)


@given(problems(), st.booleans(), st.integers(0, 2**32 - 1), st.sampled_from([1.5, 8.0, 500.0]))
def test_weighted_paths_are_optimal(
    problem: tuple[BoolArray, Cell, Cell], cut: bool, seed: int, high: float
) -> None:
    mask, start, goal = problem
    drawn = np.random.default_rng(seed).uniform(1.0, high, mask.shape)
    factors = np.rint(drawn * 1024.0) / 1024.0
    best = reference(mask, start, goal, cut, factors)
    path = GridSpace(mask, factors).shortest(start, goal, cut)
    if path is None:
        assert math.isinf(best)
        return
    # 577/408 is sqrt(2) to a millionth.
    assert path.cost == pytest.approx(best, rel=2e-6, abs=1e-9)
    assert_legal(mask, path, start, goal, cut)


@given(problems(), st.booleans())
def test_lengths_are_the_same_both_ways_and_every_time(
    problem: tuple[BoolArray, Cell, Cell], cut: bool
) -> None:
    """A query leaves nothing behind that changes a later one."""
    mask, start, goal = problem
    space = GridSpace(mask)
    first = space.shortest(start, goal, cut)
    back = space.shortest(goal, start, cut)
    bent = space.any_angle(start, goal, cut)
    again = space.shortest(start, goal, cut)
    found = {path is None for path in (first, back, bent, again)}
    assert len(found) == 1
    if first is None or back is None or again is None or bent is None:
        return
    assert first.length_cells == pytest.approx(back.length_cells, abs=1e-9)
    assert (first.cells == again.cells).all()
    assert bent.length_cells >= math.dist(start, goal) - 1e-9


@given(problems(), st.booleans())
def test_any_angle_paths_see_from_bend_to_bend(problem: tuple[BoolArray, Cell, Cell], cut: bool) -> None:
    """Every leg touches free cells only, checked by sampling; the path is never much longer than A*'s."""
    mask, start, goal = problem
    space = GridSpace(mask)
    path = space.any_angle(start, goal, cut)
    shortest = space.shortest(start, goal, cut)
    if path is None or shortest is None:
        assert path is None
        assert shortest is None
        return
    assert tuple(path.cells[0]) == start
    assert tuple(path.cells[-1]) == goal
    assert path.length_cells <= shortest.length_cells * 1.02 + 1e-9
    for a, b in zip(path.cells, path.cells[1:], strict=False):
        assert crosses_only_free(mask, a, b)
        assert space.sees(tuple(b), tuple(a), cut)


def crosses_only_free(mask: BoolArray, a: Any, b: Any) -> bool:
    """Sampled densely, away from the borders of cells where rounding would decide."""
    for t in np.linspace(0.0, 1.0, 401):
        point = a + t * (b - a)
        if np.abs(point - np.floor(point) - 0.5).min() > 1e-6 and mask[tuple(np.rint(point).astype(int))]:
            return False
    return True


@given(masks(), st.booleans())
def test_components_are_those_of_a_flood(mask: BoolArray, cut: bool) -> None:
    stride = mask.shape[1] + 2
    states = grid_moves.padded(mask)
    runs = grid_components.label_runs(states, stride, cut)
    labels, count = ndimage.label(~mask, np.ones((3, 3)) if cut else None)
    found = np.array(
        [
            [
                grid_components.component_of(runs, stride, (r + 1) * stride + c + 1)
                for c in range(mask.shape[1])
            ]
            for r in range(mask.shape[0])
        ]
    )
    assert ((found < 0) == mask).all()
    assert len(set(zip(found[~mask].tolist(), labels[~mask].tolist(), strict=True))) == count


@given(masks())
def test_distances_are_exact(mask: BoolArray) -> None:
    if mask.any():
        expected = np.rint(ndimage.distance_transform_edt(~mask) ** 2)
        assert (grid_distance.squared_distance(mask) == expected).all()
        for cells in (1, 3):
            near = grid_distance.near_distance(mask, cells)
            within = expected <= cells * cells
            assert (near[within] == expected[within]).all()
            assert (near[~within] > cells * cells).all()


@given(arrays(np.bool_, (8,)))
@example(np.zeros(8, np.bool_))
def test_the_table_says_what_the_neighbours_say(around: BoolArray) -> None:
    """Every neighbourhood, every direction, read from the table and asked one by one."""
    window = np.zeros((3, 3), np.bool_)
    for direction in range(8):
        row, column = grid_moves.ROW_STEP[direction], grid_moves.COLUMN_STEP[direction]
        window[1 + row, 1 + column] = around[direction]
    states = grid_moves.padded(window)
    offset = grid_moves.offsets(5)
    code = grid_moves.blocked_around(states, 12, 5)
    assert [bool(code >> d & 1) for d in range(8)] == around.tolist()
    moves = np.empty(8, np.uint8)
    for cut in (False, True):
        table = grid_moves.move_table(cut)
        for came in range(9):
            count = grid_moves.pruned_moves(states, 12, came, offset, cut, moves)
            entry = int(table[came, code])
            assert entry & 15 == count
            assert [entry >> 4 + 3 * i & 7 for i in range(count)] == moves[:count].tolist()


class TestScale:
    @pytest.mark.parametrize("scale", [grid_search.NARROW, grid_search.WIDE, grid_search.WEIGHTED])
    def test_costs_are_a_convergent_of_sqrt_2(self, scale: grid_search.Scale) -> None:
        """R^2 - 2 D^2 = +-1 holds for the convergents and for nothing else."""
        assert abs(scale.diagonal**2 - 2 * scale.straight**2) == 1

    def test_no_two_lengths_are_confused_within_the_proven_range(self) -> None:
        """The worst differences a + b sqrt(2) are where a/b is nearest to -sqrt(2)."""
        scale = grid_search.NARROW
        b = np.arange(1, scale.straight, dtype=np.int64)
        floor = np.array([math.isqrt(2 * int(n) ** 2) for n in b])
        for a in (floor, floor + 1):
            truth = np.sign(a * a - 2 * b * b)
            assert (np.sign(a * scale.straight - b * scale.diagonal) == truth).all()

    def test_long_ways_are_searched_again_with_wider_numbers(self) -> None:
        """A serpentine of 90,000 cells: out of range for 32 bits, and its length is exact."""
        mask = np.zeros((599, 300), np.bool_)
        mask[1::2] = True
        mask[1::4, -1] = False
        mask[3::4, 0] = False
        goal = (598, 299 if (mask.shape[0] // 2) % 2 == 0 else 0)
        path = GridSpace(mask).shortest((0, 0), goal)
        assert path is not None
        assert path.length_cells == len(path.cells) - 1
        assert path.length_cells == 300 * 299 + 2 * 299


class TestSpace:
    def test_misuse_is_said(self) -> None:
        mask = np.zeros((3, 4), np.bool_)
        with pytest.raises(InputError, match="one a cell"):
            GridSpace(mask, np.ones((4, 3)))
        for bad in (0.0, -1.0, math.nan, math.inf):
            with pytest.raises(InputError, match="above 0"):
                GridSpace(mask, np.full((3, 4), bad))
        with pytest.raises(InputError, match="rows and columns"):
            GridSpace(np.zeros((0, 4), np.bool_))
        with pytest.raises(InputError, match="astar"):
            GridSpace(mask, np.ones((3, 4))).any_angle((0, 0), (1, 1))

    def test_blocked_or_outside_ends_have_no_path(self) -> None:
        space = GridSpace(np.eye(3, dtype=np.bool_))
        for end in ((0, 0), (-1, 0), (0, 3), (3, 0)):
            assert not space.is_free(end)
            assert space.shortest((0, 1), end) is None

    def test_start_and_goal_may_be_the_same(self) -> None:
        path = GridSpace(np.zeros((2, 2), np.bool_)).shortest((1, 1), (1, 1))
        assert path is not None
        assert path.length_cells == 0.0
        assert path.cells.tolist() == [[1, 1]]

    def test_the_callers_mask_is_left_alone(self) -> None:
        mask = np.zeros((5, 5), np.bool_)
        space = GridSpace(mask)
        space.shortest((0, 0), (4, 4))
        assert not mask.any()

    def test_a_line_through_a_corner_asks_for_both_sides(self) -> None:
        mask = np.zeros((2, 2), np.bool_)
        mask[0, 1] = True
        space = GridSpace(mask)
        assert not space.sees((0, 0), (1, 1))
        assert space.sees((0, 0), (1, 1), cut_corners=True)
