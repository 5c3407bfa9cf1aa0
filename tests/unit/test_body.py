"""The body: limits, exact clearance, collisions that stop it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import Pose2, Twist
from pilotage.maps.segment_map import SegmentMap
from pilotage.missions.floor import BodyConfig, MotionConfig
from pilotage.sim.body import DifferentialDriveBody

ROOM = SegmentMap.of(
    np.array(
        [[-3, -3, 3, -3], [3, -3, 3, 3], [3, 3, -3, 3], [-3, 3, -3, -3], [0.5, 1, 0.5, 2.0]], dtype=float
    ),
    np.array([[-1.5, -1.5, 0.4]]),
)
FAST = MotionConfig(
    max_speed_m_s=2.0,
    max_turn_rate_rad_s=3.0,
    max_acceleration_m_s2=100.0,
    max_turn_acceleration_rad_s2=100.0,
)


def body_at(x: float, y: float, theta: float, motion: MotionConfig = FAST) -> DifferentialDriveBody:
    return DifferentialDriveBody(BodyConfig(radius_m=0.3), motion, Pose2(x, y, theta), ROOM)


def test_a_wall_stops_the_disc_at_its_radius() -> None:
    body = body_at(1.0, 0.0, 0.0)
    for _ in range(30):
        body.step(Twist(1.0, 0.0), 0.1)
    assert body.pose.x_m == pytest.approx(3.0 - 0.3, abs=1e-9)
    assert body.clearance_m == pytest.approx(0.0, abs=1e-9)
    assert body.collisions == 1  # leaning on the wall is one collision, not thirty


def test_backing_off_and_hitting_again_counts_twice() -> None:
    body = body_at(2.5, 0.0, 0.0)
    for speed, steps in ((1.0, 4), (-1.0, 4), (1.0, 6)):
        for _ in range(steps):
            body.step(Twist(speed, 0.0), 0.1)
    assert body.collisions == 2


def test_a_thin_wall_cannot_be_jumped_at_any_speed() -> None:
    body = body_at(-0.5, 1.5, 0.0)
    body.step(Twist(2.0, 0.0), 1.0)  # one step across the wall at x = 0.5
    assert body.pose.x_m == pytest.approx(0.5 - 0.3, abs=1e-6)
    assert body.collisions == 1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)), min_size=1, max_size=40))
def test_the_disc_never_enters_anything(commands: list[tuple[float, float]]) -> None:
    body = body_at(0.0, 0.0, 0.3)
    for v, w in commands:
        body.step(Twist(v, w), 0.1)
        assert ROOM.distance_m(body.pose.x_m, body.pose.y_m) >= 0.3 - 1e-6
        assert body.clearance_m == pytest.approx(
            ROOM.distance_m(body.pose.x_m, body.pose.y_m) - 0.3, abs=1e-9
        )


def test_speed_and_acceleration_are_limited() -> None:
    limits = MotionConfig(
        max_speed_m_s=0.5,
        max_turn_rate_rad_s=1.0,
        max_acceleration_m_s2=1.0,
        max_turn_acceleration_rad_s2=2.0,
    )
    body = body_at(0.0, 0.0, 0.0, limits)
    speeds, turns = [], []
    for _ in range(8):
        body.step(Twist(9.0, -9.0), 0.1)
        speeds.append(body.twist.v_m_s)
        turns.append(body.twist.w_rad_s)
    assert speeds == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5, 0.5])
    assert turns == pytest.approx([-0.2, -0.4, -0.6, -0.8, -1.0, -1.0, -1.0, -1.0])


def test_turning_on_the_spot_moves_nothing() -> None:
    body = body_at(0.0, 0.0, 0.0)
    for _ in range(10):
        distance, _ = body.step(Twist(0.0, 1.0), 0.1)
        assert distance == 0.0
    assert body.pose.theta_rad == pytest.approx(1.0)
    assert (body.pose.x_m, body.pose.y_m) == (0.0, 0.0)
    assert math.isfinite(body.clearance_m)
