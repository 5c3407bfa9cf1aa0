"""A path in time: no faster than it may be, on the path, at rest where it turns back and at corners."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.rrt import reeds_shepp
from pilotage.stack.navigator.reference import Ends, Reference
from pilotage.stack.navigator.timed_path import laid_out, with_turns

DT_S = 0.05


def curve(goal: tuple[float, float, float], radius_m: float = 0.8) -> tuple[FloatArray, int]:
    """States each 2 cm along a Reeds-Shepp curve from the origin, and how often it changes direction."""
    word, _ = reeds_shepp.shortest(0.0, 0.0, 0.0, *goal, radius_m, 1.0)
    length = reeds_shepp.word_length(word, radius_m)
    count = max(2, math.ceil(length / 0.02))
    rows = [reeds_shepp.follow(word, length * i / count, radius_m)[:3] for i in range(count + 1)]
    signs = np.sign(word[np.abs(word[:, 1]) > 0.05, 1])
    return np.array(rows), int(np.count_nonzero(np.diff(signs)))


goals = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)).filter(
    lambda goal: math.hypot(goal[0], goal[1]) > 0.3
)


@settings(max_examples=60, deadline=None)
@given(goals, st.floats(0.1, 1.5), st.floats(0.1, 2.0))
def test_speed_and_acceleration_stay_within_their_limits(
    goal: tuple[float, float, float], speed: float, acceleration: float
) -> None:
    states, _ = curve(goal)
    rows = laid_out(states, speed, acceleration, 5.0, 0.2, DT_S)
    v = rows[:, 3]
    assert np.abs(v).max() <= speed + 1e-6
    # Within a piece; of two means over a step each.
    inside = v[1:] * v[:-1] > 0.0
    assert (np.abs(np.diff(v))[inside] <= acceleration * DT_S * 1.05 + 1e-3).all()
    # What it begins with and what it ends with is reached from rest within a step.
    assert abs(v[-1]) <= acceleration * DT_S + 0.02
    assert np.isfinite(rows).all()


@settings(max_examples=60, deadline=None)
@given(goals, st.floats(0.1, 1.5), st.floats(0.2, 2.0))
def test_every_row_lies_on_the_path_and_the_way_never_goes_back(
    goal: tuple[float, float, float], speed: float, acceleration: float
) -> None:
    states, _ = curve(goal)
    rows = laid_out(states, speed, acceleration, math.inf, 0.0, DT_S)
    away = np.hypot(*(rows[:, None, :2] - states[None, :, :2]).transpose(2, 0, 1))
    assert away.min(axis=1).max() < 0.011
    # The nearest states advance: never more than their spacing backwards, also where the path meets itself.
    driven = np.concatenate([[0.0], np.cumsum(np.abs(rows[:, 3]) * DT_S)])
    length = np.hypot(*np.diff(states[:, :2], axis=0).T).sum()
    assert (np.diff(driven) >= 0.0).all()
    assert driven[-1] == pytest.approx(length, rel=1e-6)
    assert rows[-1, :2] == pytest.approx(states[-1, :2], abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(goals)
def test_it_rests_before_each_piece(goal: tuple[float, float, float]) -> None:
    states, changes = curve(goal)
    rows = laid_out(states, 0.5, 0.5, 5.0, 1.0, DT_S)
    rests = np.count_nonzero(np.diff((rows[:, 3] == 0.0).astype(int)) == 1) + 1
    assert (rows[: round(1.0 / DT_S), 3] == 0.0).all()
    assert rests >= changes + 1
    directions = np.sign(rows[rows[:, 3] != 0.0, 3])
    assert np.count_nonzero(np.diff(directions)) >= changes


def test_wheels_that_turn_slowly_slow_it_down_where_the_curvature_jumps() -> None:
    straight = np.column_stack([np.arange(0.0, 2.0, 0.02), np.zeros(100), np.zeros(100)])
    angles = np.arange(0.0, 1.5, 0.02)
    bend = np.column_stack([2.0 + np.sin(angles), 1.0 - np.cos(angles), angles])
    states = np.concatenate([straight, bend])
    quick = laid_out(states, 1.0, 1.0, math.inf, 0.0, DT_S)
    slow = laid_out(states, 1.0, 1.0, 2.0, 0.0, DT_S)
    assert len(slow) > len(quick)
    at_jump = np.abs(slow[:, 0] - 2.0) < 0.04
    assert slow[at_jump, 3].max() <= 0.1 * 2.0 / 1.0 + 0.02
    assert quick[np.abs(quick[:, 0] - 2.0) < 0.04, 3].max() > 0.9
    # Two laps of the same path take the same time.
    assert (laid_out(states, 1.0, 1.0, 2.0, 0.0, DT_S) == slow).all()


def test_wheels_are_turned_at_rest_to_the_side_of_the_arc_that_begins_there() -> None:
    """Before a piece backwards they were turned to the other one: it began with a bend of its own."""
    for goal in ((-1.0, 0.6, -0.9), (1.0, 0.6, 0.9), (-1.0, -0.6, 0.9), (1.0, -0.6, -0.9)):
        rows = laid_out(curve(goal)[0], 0.5, 1.0, 5.0, 0.4, DT_S)
        rests = np.flatnonzero((rows[:-1, 3] == 0.0) & (rows[:-1, 4] != 0.0) & (rows[1:, 3] != 0.0))
        assert len(rests)
        for row in rests:
            v, w = rows[row + 1, 3:5]
            assert rows[row, 4] * (w / v) > 0.0


def test_at_corners_it_turns_first_by_the_shorter_way() -> None:
    leg = np.linspace(0.0, 1.0, 11)
    there = np.column_stack([leg, np.zeros(11), np.zeros(11)])
    up = np.column_stack([np.ones(11), leg, np.full(11, 0.5 * np.pi)])
    back = np.column_stack([np.ones(11), leg[::-1], np.full(11, -0.5 * np.pi)])
    rows = with_turns(np.vstack([there[:-1], up[:-1], back]), np.pi / 2, 1.0, 0.5, 1.0, 0.1)
    stands = rows[:, 3] == 0.0
    turns = np.flatnonzero(np.diff(np.concatenate([[False], stands & (rows[:, 4] != 0.0)]).astype(int)) == 1)
    assert len(turns) == 3  # before the first leg, at the corner, and before the way back
    turned = [0.1 * rows[k:][: int(np.argmin(rows[k:, 4] != 0.0)), 4].sum() for k in turns]
    assert np.abs(turned) == pytest.approx([np.pi / 2, np.pi / 2, np.pi])
    assert turned[:2] == pytest.approx([-np.pi / 2, np.pi / 2])
    # Nobody jumps, nobody is too fast, and it ends where the path does.
    assert np.hypot(*np.diff(rows[:, :2], axis=0).T).max() <= 0.5 * 0.1 + 1e-9
    assert rows[-1, :3] == pytest.approx([1.0, 0.0, -np.pi / 2])


def test_turns_on_the_spot_begin_and_end_at_rest() -> None:
    """Told to turn at its full rate at once a robot comes late, and turns too far."""
    leg = np.linspace(0.0, 1.0, 11)
    path = np.column_stack([leg, np.zeros(11), np.zeros(11)])
    for turn in (0.02, 0.4, 3.0):
        rows = with_turns(path, turn, 1.0, 0.5, 1.0, 0.1, 2.0)
        count = int(np.argmax(rows[:, 3] != 0.0))
        rates = np.concatenate([[0.0], rows[:count, 4], [0.0]])
        assert np.abs(np.diff(rates)).max() <= 2.0 * 0.1 + 1e-9
        assert np.abs(rates).max() <= 1.0 + 1e-9
        assert 0.1 * rates.sum() == pytest.approx(-turn)
        assert rows[count - 1, 2] == pytest.approx(0.0, abs=1e-9)


def test_a_reference_stops_where_a_turn_or_a_line_ends() -> None:
    """With its clock at 0.7 it passed corners in the middle of a step."""
    leg = np.linspace(0.0, 1.0, 11)
    path = np.column_stack([leg, np.zeros(11), np.zeros(11)])
    reference = Reference(with_turns(path, 0.5 * np.pi, 1.0, 0.5, 1.0, 0.1), 0.1)
    assert reference.ends is Ends.NEITHER
    ended: list[tuple[Ends, float, float, float]] = []
    while not reference.done:
        reference.rate = 0.7
        reference.step()
        if reference.ends is not Ends.NEITHER:
            ended.append((reference.ends, *reference.pose().tolist()))
            held = reference.hold()
            assert held[:5] == pytest.approx([*reference.pose(), 0.0, 0.0])
    assert [kind for kind, *_ in ended] == [Ends.TURN, Ends.LINE]
    assert ended[0][1:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert ended[1][1:] == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)
