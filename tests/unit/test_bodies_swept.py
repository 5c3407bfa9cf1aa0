"""Bodies stop where they first touch something, between two steps as well: against fine stepping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2, Twist, WheelSpeeds
from pilotage.kernels.bodies.drive import ANGLE, DISTANCE
from pilotage.kernels.geometry.motion import exact_arc, sideways
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig
from pilotage.sim.worlds.world import World
from support.worlds import CAR, DISC, robot, simulator

WIDE = (-50.0, -50.0, 50.0, 50.0)
EMPTY = WorldMap("empty", WIDE)
BAR = Footprint.polygon(np.array([[0.8, 0.05], [-0.8, 0.05], [-0.8, -0.05], [0.8, -0.05]]))
FAST = DifferentialDriveConfig(
    max_speed_m_s=100.0,
    max_acceleration_m_s2=1e4,
    max_turn_rate_rad_s=100.0,
    max_turn_acceleration_rad_s2=1e4,
)
EXACT = WheelErrorsConfig(
    radius_difference=0.0, separation_error=(0.0, 0.0), slip=(0.0, 0.0), slip_std_m_sqrt_m=0.0
)


def walls(*segments: tuple[float, float, float, float]) -> WorldMap:
    geometry = SegmentMap(np.array(segments, dtype=float), np.zeros((0, 3)), WIDE)
    return WorldMap("walls", WIDE, geometry=geometry)


@pytest.mark.parametrize("shape", [DISC, CAR, BAR], ids=["disc", "car", "bar"])
@given(
    seed=st.integers(0, 10_000),
    forward=st.floats(-2.0, 2.0),
    aside=st.sampled_from([0.0, -0.7, 1.0]),
    turn=st.floats(-3.0, 3.0),
    on_grid=st.booleans(),
)
def test_a_sweep_stops_where_fine_steps_first_overlap(
    shape: Footprint, seed: int, forward: float, aside: float, turn: float, on_grid: bool
) -> None:
    rng = np.random.default_rng(seed)
    chart = EMPTY
    obstacles, circles = np.zeros((0, 4)), np.zeros((0, 3))
    if on_grid:
        cells = np.where(rng.random((16, 16)) < 0.04, 100, 0).astype(np.int8)
        chart = WorldMap("grid", WIDE, grid=OccupancyGrid(cells, 0.25, Pose2(-2.0, -2.0, 0.3)))
    else:
        a = rng.uniform(-2.5, 2.5, (3, 2))
        obstacles = np.hstack([a, a + rng.uniform(-0.4, 0.4, (3, 2))])
        circles = np.column_stack([rng.uniform(-2.5, 2.5, (2, 2)), rng.uniform(0.02, 0.3, 2)])
    world = World.of(chart, obstacles, circles)
    start = Pose2(0.0, 0.0, float(rng.uniform(-3.0, 3.0)))
    if world.clearance_m(shape, start.as_array()[None, :])[0] <= 0.01:
        return
    move = (forward, aside, turn)
    end, part = world.advance(shape, start, move)
    fractions = np.linspace(0.0, 1.0, 4001)
    clear = world.clearance_m(shape, poses_along(start, move, fractions))
    step = (math.hypot(forward, aside) + shape.radius_m * abs(turn)) / 4000
    overlapped = np.flatnonzero(clear < -1e-6)
    if overlapped.size:
        first = fractions[overlapped[0]]
        assert part <= first + 1e-9
        # It may have stopped earlier only at a graze that fine steps see as nearly touching.
        before = clear[(fractions >= part - 2.0 / 4000) & (fractions <= first)]
        assert part >= first - 2.0 / 4000 or before.min() < step
        assert abs(world.clearance_m(shape, end.as_array()[None, :])[0]) < 1e-6
    elif part < 1.0:
        assert clear.min() < step
    else:
        assert end.x_m == pytest.approx(poses_along(start, move, np.array([1.0]))[0, 0])


def poses_along(start: Pose2, move: tuple[float, float, float], fractions: np.ndarray) -> np.ndarray:
    """Integrated in the other way: by the exact solution of x' = v cos, y' = v sin at constant twist."""
    forward, aside, turn = move
    if abs(turn) < 1e-9:
        x, y = fractions * forward, fractions * aside
    else:
        s, c = np.sin(fractions * turn) / turn, (1.0 - np.cos(fractions * turn)) / turn
        x, y = s * forward - c * aside, c * forward + s * aside
    cos, sin = math.cos(start.theta_rad), math.sin(start.theta_rad)
    return np.column_stack(
        [
            start.x_m + cos * x - sin * y,
            start.y_m + sin * x + cos * y,
            start.theta_rad + fractions * turn,
        ]
    )


def test_a_fast_body_does_not_jump_over_a_thin_wall() -> None:
    sim = simulator(robot(motion=FAST, start=Pose2(0.0, 0.0, 0.0)), walls((3.0, -1.0, 3.0, 1.0)))
    sim.step([Twist(80.0, 0.0)])
    body = sim.bodies[0]
    assert body.pose.x_m == pytest.approx(2.7, abs=1e-6)
    assert (body.collisions, body.touching) == (1, True)
    assert body.twist == Twist(0.0, 0.0)
    for _ in range(3):
        sim.step([Twist(10.0, 0.0)])
    assert body.collisions == 1
    sim.step([Twist(-10.0, 0.0)])
    assert not body.touching
    assert body.driven_m == pytest.approx(3.7, abs=1e-5)


def test_a_bar_that_turns_on_the_spot_stops_at_the_post() -> None:
    post = WorldMap("post", WIDE, geometry=SegmentMap.of(np.zeros((0, 4)), np.array([[0.0, 0.6, 0.1]])))
    sim = simulator(robot(motion=FAST, footprint=BAR, start=Pose2(0.0, 0.0, 0.0)), post)
    sim.step([Twist(0.0, 30.0)])
    body = sim.bodies[0]
    # Its long side touches the post: 0.6 cos(theta) = 0.1 + 0.05.
    assert body.pose.theta_rad == pytest.approx(math.pi / 2 - math.asin(0.15 / 0.6), abs=1e-6)
    assert body.collisions == 1
    assert body.pose.x_m == 0.0
    sim.step([Twist(0.0, -20.0)])
    assert body.clearance_m > 0.1


def test_a_body_slides_along_a_wall_that_it_touches_and_drives_away_from_it() -> None:
    chart = walls((-20.0, 0.0, 20.0, 0.0))
    for shape, height in ((DISC, 0.3), (CAR, 0.25)):
        sim = simulator(robot(footprint=shape, motion=FAST, start=Pose2(0.0, height, 0.0)), chart)
        for _ in range(5):
            sim.step([Twist(1.0, 0.0)])
        assert sim.bodies[0].pose.x_m == pytest.approx(0.5)
        assert sim.bodies[0].collisions == 0
        sim.step([Twist(0.0, 0.0)])
        sim.bodies[0].carry_to(Pose2(0.0, height + 0.5, math.pi / 2))
        sim.step([Twist(3.0, 0.0)])
        assert sim.bodies[0].pose.y_m == pytest.approx(height + 0.8)


def test_a_car_keeps_its_steering_limits_and_cannot_turn_on_the_spot() -> None:
    config = BicycleConfig(wheelbase_m=0.5, max_steering_rad=0.5, max_steering_rate_rad_s=1.0)
    sim = simulator(robot(motion=config, start=Pose2(0.0, 0.0, 0.0)), EMPTY)
    body = sim.bodies[0]
    sim.step([Twist(0.0, 1.0)])
    assert body.pose == Pose2(0.0, 0.0, 0.0)
    assert body.motion.steering_rad == pytest.approx(0.1)  # type: ignore[attr-defined]
    for _ in range(20):
        sim.step([Twist(0.5, 10.0)])
    assert body.motion.steering_rad == pytest.approx(0.5)  # type: ignore[attr-defined]
    radius = body.twist.v_m_s / body.twist.w_rad_s
    assert radius == pytest.approx(config.least_turning_radius_m)
    for _ in range(30):
        sim.step([Twist(-0.5, 0.5 / config.least_turning_radius_m)])
    assert body.twist.v_m_s == pytest.approx(-0.5)
    assert body.twist.w_rad_s == pytest.approx(0.5 / config.least_turning_radius_m)


def test_a_full_circle_of_an_omnidirectional_base_closes() -> None:
    config = OmnidirectionalConfig(max_acceleration_m_s2=1e4, max_turn_acceleration_rad_s2=1e4)
    sim = simulator(robot(motion=config, start=Pose2(1.0, 2.0, 0.4)), EMPTY)
    for _ in range(40):
        sim.step([Twist(0.3, 2 * math.pi / 4.0, 0.4)])
    pose = sim.bodies[0].pose
    assert [pose.x_m, pose.y_m, pose.theta_rad] == pytest.approx([1.0, 2.0, 0.4], abs=1e-9)
    assert sim.bodies[0].driven_m == pytest.approx(0.5 * 4.0)
    assert sim.bodies[0].twist.lateral_m_s == pytest.approx(0.4)


def test_a_wheel_drive_follows_twists_by_its_data_sheet_and_slows_both_wheels_alike() -> None:
    config = WheelDriveConfig(motor_lag_s=0.0, errors=EXACT, max_wheel_speed_rad_s=10.0)
    sim = simulator(robot(motion=config, start=Pose2(0.0, 0.0, 0.0)), EMPTY)
    sim.step([Twist(0.2, 0.5)])
    # The wheels' path is the chord of each short arc.
    assert sim.bodies[0].twist.v_m_s == pytest.approx(0.2, rel=1e-5)
    assert sim.bodies[0].twist.w_rad_s == pytest.approx(0.5)
    sim.step([Twist(2.0, 5.0)])
    assert sim.bodies[0].twist.w_rad_s / sim.bodies[0].twist.v_m_s == pytest.approx(2.5, rel=1e-5)
    sim.step([WheelSpeeds(99.0, -99.0)])
    assert sim.bodies[0].twist.v_m_s == pytest.approx(0.0, abs=1e-12)
    assert -sim.bodies[0].twist.w_rad_s == pytest.approx(config.top_turn_rate_rad_s)


def test_spinning_wheels_turn_a_body_that_something_holds() -> None:
    config = WheelDriveConfig(motor_lag_s=0.0, errors=EXACT, max_wheel_speed_rad_s=10.0)
    spec = robot(motion=config, footprint=Footprint.disc(0.1), start=Pose2(0.0, 0.0, 0.0))
    sim = simulator(spec, walls((0.15, -1.0, 0.15, 1.0)))
    for _ in range(10):
        sim.step([WheelSpeeds(9.0, 10.0)])
    body = sim.bodies[0]
    assert body.touching
    assert body.collisions == 1
    assert 0.0 <= body.clearance_m < 0.01
    assert body.pose.theta_rad == pytest.approx(0.035 / 0.1421, rel=1e-3)


@pytest.mark.parametrize("motion", [DifferentialDriveConfig(), BicycleConfig(), OmnidirectionalConfig()])
def test_wheel_speeds_are_for_wheel_drives(motion: MotionConfig) -> None:
    sim = simulator(robot(motion=motion), EMPTY)
    with pytest.raises(InputError, match=r"robot\.motion: expected a twist as command, found WheelSpeeds"):
        sim.step([WheelSpeeds(1.0, 1.0)])


def test_what_wheels_of_their_own_speed_drive_is_told_with_what_is_beside_an_arc() -> None:
    sim = simulator(robot(motion=WheelDriveConfig(motor_lag_s=0.3), start=Pose2(1.0, 2.0, 0.4)), EMPTY, 0.2)
    body, told, aside = sim.bodies[0], Pose2(1.0, 2.0, 0.4), []
    for k in range(30):
        sim.step([Twist(0.3, 3.0 if k % 6 < 3 else -3.0)])
        distance, lateral, angle = body.state[DISTANCE : ANGLE + 1].tolist()
        x, y, theta = exact_arc(told.x_m, told.y_m, told.theta_rad, distance, angle)
        dx, dy = sideways(theta, lateral, angle, True)
        told = Pose2(x + dx, y + dy, theta)
        aside.append(abs(lateral))
    assert max(aside) > 1e-5
    assert told.as_array() == pytest.approx(body.pose.as_array(), abs=1e-9)
