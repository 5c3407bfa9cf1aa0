"""Reeds-Shepp curves: they end at the goal, none is longer than Dubins', turned problems agree."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.rrt import dubins, reeds_shepp

coordinate = st.floats(-8.0, 8.0)
angle = st.floats(-3.1, 3.1)
radius = st.floats(0.2, 4.0)
Pose = tuple[float, float, float]
pose = st.tuples(coordinate, coordinate, angle)


def length(a: Pose, b: Pose, r: float, reverse_cost: float = 1.0) -> float:
    here, there = (float(a[0]), float(a[1]), float(a[2])), (float(b[0]), float(b[1]), float(b[2]))
    return float(reeds_shepp.shortest(*here, *there, r, reverse_cost)[1])


def end(a: Pose, word: np.ndarray[tuple[int, int], np.dtype[np.float64]], r: float) -> Pose:
    """Where a word leads from a pose."""
    x, y, theta, _ = reeds_shepp.follow(word, reeds_shepp.word_length(word, r), r)
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * x - s * y, a[1] + s * x + c * y, a[2] + theta


def off(a: Pose, b: Pose) -> float:
    """How far two poses are apart, headings as half the chord of the unit circle."""
    return max(math.hypot(a[0] - b[0], a[1] - b[1]), abs(math.sin(0.5 * (a[2] - b[2]))))


@given(pose, pose, radius, st.floats(1.0, 4.0))
def test_it_ends_at_the_goal_and_costs_what_it_says(a: Pose, b: Pose, r: float, reverse_cost: float) -> None:
    word, cost = reeds_shepp.shortest(*a, *b, r, reverse_cost)
    assert off(end(a, word, r), b) < 1e-5 * max(r, 1.0)
    pieces = word[:, 1] * r
    assert cost == pytest.approx(
        np.maximum(pieces, 0.0).sum() + reverse_cost * np.maximum(-pieces, 0.0).sum(), abs=1e-9
    )
    assert cost >= math.hypot(b[0] - a[0], b[1] - a[1]) - 1e-6
    assert set(np.unique(word[:, 0])) <= {-1.0, 0.0, 1.0}


@given(pose, pose, radius)
def test_reversing_is_never_longer_than_not_to(a: Pose, b: Pose, r: float) -> None:
    forwards = dubins.length_of(dubins.shortest(*a, *b, r))
    assert length(a, b, r) <= forwards + 1e-5 * max(r, 1.0)
    assert length(a, b, r) <= length(a, b, r, 2.0) + 1e-9 <= 2.0 * length(a, b, r) + 2e-9


@given(pose, pose, radius)
def test_there_and_back_mirrored_scaled_and_backwards_are_as_long(a: Pose, b: Pose, r: float) -> None:
    there = length(a, b, r)
    mirrored = length((a[0], -a[1], -a[2]), (b[0], -b[1], -b[2]), r)
    scaled = length((3 * a[0], 3 * a[1], a[2]), (3 * b[0], 3 * b[1], b[2]), 3 * r) / 3.0
    about_face = length((-a[0], a[1], -a[2]), (-b[0], b[1], -b[2]), r)
    for other in (length(b, a, r), mirrored, scaled, about_face):
        assert other == pytest.approx(there, abs=1e-5 * max(r, 1.0))


@given(pose, pose, radius, st.floats(0.0, 1.0))
def test_the_path_turns_no_tighter_than_its_radius(a: Pose, b: Pose, r: float, share: float) -> None:
    word, _ = reeds_shepp.shortest(*a, *b, r, 1.5)
    total = reeds_shepp.word_length(word, r)
    x0, y0, th0, _ = reeds_shepp.follow(word, share * total, r)
    x1, y1, th1, _ = reeds_shepp.follow(word, min(share * total + 0.01, total), r)
    assert math.hypot(x1 - x0, y1 - y0) <= 0.01 + 1e-9
    assert abs(th1 - th0) * r <= 0.01 + 1e-9


def test_known_lengths() -> None:
    assert length((0, 0, 0), (5, 0, 0), 1.0) == pytest.approx(5.0)
    assert length((0, 0, 0), (-5, 0, 0), 1.0) == pytest.approx(5.0)
    assert length((0, 0, 0), (0, 0, 0), 1.0) == pytest.approx(0.0, abs=1e-9)
    # Turned on the spot by half a turn: three arcs of a sixth of a circle, the middle one the other way.
    assert length((0, 0, 0), (0, 0, math.pi), 1.0) == pytest.approx(math.pi)


def test_the_lengths_are_those_of_ompl() -> None:
    base = pytest.importorskip("ompl.base", reason="the bench extra's peer is not installed")
    rng = np.random.default_rng(0)
    for r in (0.5, 1.0, 2.5):
        space = base.ReedsSheppStateSpace(r)
        bounds = base.RealVectorBounds(2)
        bounds.setLow(-20.0)
        bounds.setHigh(20.0)
        space.setBounds(bounds)
        for _ in range(400):
            a, b = (tuple(rng.uniform([-8, -8, -math.pi], [8, 8, math.pi]).tolist()) for _ in range(2))
            states = []
            for x, y, theta in (a, b):
                state = space.allocState()
                state.setX(x)
                state.setY(y)
                state.setYaw(theta)
                states.append(state)
            assert length(a, b, r) == pytest.approx(space.distance(*states), abs=1e-5 * max(r, 1.0))
