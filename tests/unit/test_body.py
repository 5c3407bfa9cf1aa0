"""The body: limits, exact clearance, collisions that stop it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import Pose2, Twist
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from support.worlds import Alone, alone, robot

ROOM = SegmentMap.of(
    np.array(
        [[-3, -3, 3, -3], [3, -3, 3, 3], [3, 3, -3, 3], [-3, 3, -3, -3], [0.5, 1, 0.5, 2.0]], dtype=float
    ),
    np.array([[-1.5, -1.5, 0.4]]),
)
CHART = WorldMap("room", ROOM.bounds_m, ROOM)
FAST = DifferentialDriveConfig(
    max_speed_m_s=2.0,
    max_turn_rate_rad_s=3.0,
    max_acceleration_m_s2=100.0,
    max_turn_acceleration_rad_s2=100.0,
)


def at(x: float, y: float, theta: float, motion: DifferentialDriveConfig = FAST, dt_s: float = 0.1) -> Alone:
    return alone(robot(motion=motion, start=Pose2(x, y, theta)), CHART, dt_s)


def test_a_wall_stops_the_disc_at_its_radius() -> None:
    sim = at(1.0, 0.0, 0.0)
    for _ in range(30):
        sim.step(Twist(1.0, 0.0))
    assert sim.body.pose.x_m == pytest.approx(3.0 - 0.3, abs=1e-9)
    assert sim.body.clearance_m == pytest.approx(0.0, abs=1e-9)
    assert sim.body.collisions == 1  # leaning on the wall is one collision, not thirty


def test_backing_off_and_hitting_again_counts_twice() -> None:
    sim = at(2.5, 0.0, 0.0)
    for speed, steps in ((1.0, 4), (-1.0, 4), (1.0, 6)):
        for _ in range(steps):
            sim.step(Twist(speed, 0.0))
    assert sim.body.collisions == 2


def test_a_thin_wall_cannot_be_jumped_at_any_speed() -> None:
    sim = at(-0.5, 1.5, 0.0, dt_s=1.0)
    sim.step(Twist(2.0, 0.0))  # one step across the wall at x = 0.5
    assert sim.body.pose.x_m == pytest.approx(0.5 - 0.3, abs=1e-6)
    assert sim.body.collisions == 1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)), min_size=1, max_size=40))
def test_the_disc_never_enters_anything(commands: list[tuple[float, float]]) -> None:
    sim = at(0.0, 0.0, 0.3)
    for v, w in commands:
        sim.step(Twist(v, w))
        assert ROOM.distance_m(sim.body.pose.x_m, sim.body.pose.y_m) >= 0.3 - 1e-6
        assert sim.body.clearance_m == pytest.approx(
            ROOM.distance_m(sim.body.pose.x_m, sim.body.pose.y_m) - 0.3, abs=1e-9
        )


def test_speed_and_acceleration_are_limited() -> None:
    limits = DifferentialDriveConfig(
        max_speed_m_s=0.5,
        max_turn_rate_rad_s=1.0,
        max_acceleration_m_s2=1.0,
        max_turn_acceleration_rad_s2=2.0,
    )
    sim = at(0.0, 0.0, 0.0, limits)
    speeds, turns = [], []
    for _ in range(8):
        sim.step(Twist(9.0, -9.0))
        speeds.append(sim.body.twist.v_m_s)
        turns.append(sim.body.twist.w_rad_s)
    assert speeds == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5, 0.5])
    assert turns == pytest.approx([-0.2, -0.4, -0.6, -0.8, -1.0, -1.0, -1.0, -1.0])


def test_turning_on_the_spot_moves_nothing() -> None:
    sim = at(0.0, 0.0, 0.0)
    for _ in range(10):
        sim.step(Twist(0.0, 1.0))
        assert sim.body.driven_m == 0.0
    assert sim.body.pose.theta_rad == pytest.approx(1.0)
    assert (sim.body.pose.x_m, sim.body.pose.y_m) == (0.0, 0.0)
    assert math.isfinite(sim.body.clearance_m)
