"""Joining frames: compose and inverse are a group, and the same as matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.types import FloatArray, Pose2

coordinate = st.floats(-50.0, 50.0)
poses = st.builds(Pose2, coordinate, coordinate, st.floats(-math.pi, math.pi, exclude_max=True))


def matrix(pose: Pose2) -> FloatArray:
    """The homogeneous transform."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    return np.array([[c, -s, pose.x_m], [s, c, pose.y_m], [0.0, 0.0, 1.0]])


def check_same(found: Pose2, expected: Pose2) -> None:
    np.testing.assert_allclose(matrix(found), matrix(expected), atol=1e-9)
    assert -math.pi <= found.theta_rad < math.pi


@given(poses, poses)
def test_compose_and_inverse_are_those_of_matrices(a: Pose2, b: Pose2) -> None:
    np.testing.assert_allclose(matrix(a.compose(b)), matrix(a) @ matrix(b), atol=1e-9)
    np.testing.assert_allclose(matrix(a.inverse()), np.linalg.inv(matrix(a)), atol=1e-9)


@given(poses, st.lists(st.tuples(coordinate, coordinate), max_size=4))
def test_points_are_placed_as_poses_are_and_seen_where_they_were(
    a: Pose2, places: list[tuple[float, float]]
) -> None:
    points = np.array(places).reshape(-1, 2)
    placed = a.placed(points)
    joined = [a.compose(Pose2(x, y, 0.0)) for x, y in places]
    np.testing.assert_allclose(placed, np.array([(b.x_m, b.y_m) for b in joined]).reshape(-1, 2), atol=1e-9)
    np.testing.assert_allclose(a.seen(placed), points, atol=1e-9)


@given(poses, poses, poses)
def test_they_are_a_group(a: Pose2, b: Pose2, c: Pose2) -> None:
    origin = Pose2(0.0, 0.0, 0.0)
    check_same(a.compose(a.inverse()), origin)
    check_same(a.inverse().compose(a), origin)
    check_same(a.compose(origin), a)
    check_same(origin.compose(a), a)
    check_same(a.compose(b).compose(c), a.compose(b.compose(c)))
    check_same(a.compose(b).inverse(), b.inverse().compose(a.inverse()))


@pytest.mark.parametrize("theta", [math.pi, -math.pi, math.nextafter(math.pi, 0.0), 3.0])
def test_angles_stay_wrapped_at_the_cut(theta: float) -> None:
    pose = Pose2(1.0, 2.0, theta)
    for found in (pose.inverse(), pose.compose(pose), pose.compose(Pose2(0.0, 0.0, 1e-17))):
        assert -math.pi <= found.theta_rad < math.pi


def test_what_lies_ahead_of_a_robot_that_looks_left() -> None:
    ahead = Pose2(2.0, 1.0, math.pi / 2).compose(Pose2(3.0, 0.0, 0.0))
    assert (ahead.x_m, ahead.y_m, ahead.theta_rad) == pytest.approx((2.0, 4.0, math.pi / 2))
