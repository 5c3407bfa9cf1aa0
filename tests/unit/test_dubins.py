"""Dubins curves: ends meet, nothing is shorter, mirrored and reversed problems agree."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.rrt import dubins

coordinate = st.floats(-8.0, 8.0)
angle = st.floats(-7.0, 7.0)
radius = st.floats(0.05, 5.0)
Pose = tuple[float, float, float]
pose = st.tuples(coordinate, coordinate, angle)


def length(a: Pose, b: Pose, r: float) -> float:
    return dubins.length_of(dubins.shortest(*a, *b, r))


def end(curve: dubins.Curve) -> Pose:
    return dubins.pose_at(curve, dubins.length_of(curve))


def off(a: Pose, b: Pose) -> float:
    """How far two poses are apart, headings as half the chord of the unit circle."""
    return max(math.hypot(a[0] - b[0], a[1] - b[1]), abs(math.sin(0.5 * (a[2] - b[2]))))


@given(pose, pose, radius)
def test_ends_meet_for_every_word_and_the_shortest_is_the_shortest(a: Pose, b: Pose, r: float) -> None:
    curve = dubins.shortest(*a, *b, r)
    best = dubins.length_of(curve)
    assert off(end(curve), b) < 1e-6
    assert best >= math.hypot(b[0] - a[0], b[1] - a[1]) - 1e-6
    for other in range(6):
        pieces = dubins.word_lengths(*a, *b, r, other)
        if math.isfinite(pieces[0]):
            assert min(pieces) >= 0.0
            assert off(end(dubins.Curve(*a, r, other, *pieces)), b) < 1e-6
            assert best <= sum(pieces) + 1e-9  # two words of one length differ by rounding


@given(pose, pose, radius)
def test_mirrored_reversed_scaled_and_moved_problems_have_the_same_length(a: Pose, b: Pose, r: float) -> None:
    straight = length(a, b, r)
    mirrored = length((a[0], -a[1], -a[2]), (b[0], -b[1], -b[2]), r)
    reversed_ = length((b[0], b[1], b[2] + math.pi), (a[0], a[1], a[2] + math.pi), r)
    scaled = length((3 * a[0], 3 * a[1], a[2]), (3 * b[0], 3 * b[1], b[2]), 3 * r) / 3.0
    for other in (mirrored, reversed_, scaled):
        # Rounding can tip a full circle, but nothing in between.
        rest = abs(other - straight) % (2.0 * math.pi * r)
        assert min(rest, 2.0 * math.pi * r - rest) < 1e-5


@given(pose, pose, radius, st.floats(0.01, 0.3))
def test_samples_are_spaced_and_bend_no_more_than_allowed(a: Pose, b: Pose, r: float, spacing: float) -> None:
    curve = dubins.shortest(*a, *b, r)
    states = dubins.sample(curve, spacing)
    steps = np.hypot(*np.diff(states[:, :2], axis=0).T)
    assert steps.max() <= spacing + 1e-9
    assert off(tuple(states[0]), a) < 1e-12
    assert off(tuple(states[-1]), b) < 1e-6
    turned = np.abs(np.angle(np.exp(1j * np.diff(states[:, 2]))))
    step_m = dubins.length_of(curve) / (len(states) - 1)
    assert (turned <= step_m / r + 1e-7).all()


@given(pose, radius)
def test_who_is_there_drives_nowhere(a: Pose, r: float) -> None:
    """By rounding it was a whole circle, half of the time."""
    assert length(a, a, r) == 0.0
    assert dubins.length_of(dubins.shortest_to_point(*a, a[0], a[1], r)) == 0.0


@given(pose, coordinate, coordinate, radius)
def test_free_heading_is_the_least_over_all_headings(a: Pose, x: float, y: float, r: float) -> None:
    curve = dubins.shortest_to_point(*a, x, y, r)
    relaxed, reached = dubins.length_of(curve), end(curve)
    assert math.hypot(reached[0] - x, reached[1] - y) < 1e-6
    scan = [length(a, (x, y, h), r) for h in np.linspace(-math.pi, math.pi, 361)]
    assert relaxed <= min(scan) + 1e-6
    # The six-word solver at the heading found cannot do better, and does as well.
    at_heading = length(a, (x, y, reached[2]), r)
    assert relaxed <= at_heading + 1e-6
    assert min(relaxed, at_heading) == pytest.approx(relaxed, abs=1e-6)


@given(pose, radius, st.floats(0.0, 20.0), st.floats(0.0, 6.0), st.sampled_from([1, -1]))
def test_straights_and_single_arcs_are_their_own_shortest(
    a: Pose, r: float, straight: float, turned: float, side: int
) -> None:
    ahead = dubins.advance(*a, 0, r, straight)
    assert length(a, ahead, r) == pytest.approx(straight, abs=1e-6)
    around = dubins.advance(*a, side, r, min(turned, math.pi) * r)
    assert length(a, around, r) <= min(turned, math.pi) * r + 1e-6


@given(pose, radius, st.floats(-1e-12, 1e-12), st.floats(-1e-12, 1e-12))
def test_coincident_poses_need_no_loop(a: Pose, r: float, dx: float, dth: float) -> None:
    assert length(a, a, r) == 0.0
    assert length(a, (a[0] + dx, a[1], a[2] + dth), r) < 1e-6 * max(1.0, r)


def test_known_lengths() -> None:
    # A U-turn over two radii is half a circle; sideways by four radii adds a straight of two.
    assert length((0, 0, 0), (0, 2, math.pi), 1.0) == pytest.approx(math.pi)
    assert length((0, 0, 0), (0, 4, math.pi), 1.0) == pytest.approx(math.pi + 2.0)
    # Turning round on the spot takes three arcs: 60, 300 and 60 degrees.
    *_, word, l0, l1, l2 = dubins.shortest(0, 0, 0, 0, 0, math.pi, 1.0)
    assert dubins.WORD_NAMES[word] in ("LRL", "RLR")
    assert np.array([l0, l1, l2]) == pytest.approx(np.radians([60.0, 300.0, 60.0]))
    # A point on the turning circle's far side.
    assert dubins.length_of(dubins.shortest_to_point(0, 0, 0, 0, 2, 1.0)) == pytest.approx(math.pi)
