"""Goals that have to be met finer than the grids are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.models.footprint import Footprint
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.local.command_check import is_safe
from pilotage.stack.control.local.drive import LocalDrive, polygon_around
from pilotage.stack.control.local.fine_goal import approach, is_fine, is_led, rests_within
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalController, LocalLimits, LocalView
from pilotage.stack.control.local.rolling import RollingGround, Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.interface import Belief
from support.robots import told_of

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
LIMITS = LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
ANGLES = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 271)
MOUNT = Pose2(0.12, 0.0, 0.0)
HALL = np.array(
    [[-3.0, -3.0, 5.0, -3.0], [5.0, -3.0, 5.0, 3.0], [5.0, 3.0, -3.0, 3.0], [-3.0, 3.0, -3.0, -3.0]]
)
NO_POSTS = np.zeros((0, 3))
CORNER_OF_CELLS, BESIDE = (2.0, 0.0), (1.53, -0.84)
"""Of the cells of the time to go: the first lies as far as can be from the middle of any."""


def view_of(
    t_s: float,
    pose: Pose2,
    twist: Twist,
    goal: tuple[float, float],
    tolerance_m: float,
    posts: FloatArray = NO_POSTS,
    limits: LocalLimits = LIMITS,
    mount: Pose2 = MOUNT,
) -> LocalView:
    """What true odometry and a perfect laser show in a hall."""
    x = pose.x_m + mount.x_m * math.cos(pose.theta_rad)
    y = pose.y_m + mount.x_m * math.sin(pose.theta_rad)
    step = float(ANGLES[1] - ANGLES[0])
    ranges = fan_ranges(x, y, pose.theta_rad + float(ANGLES[0]), step, ANGLES.size, 20.0, HALL, posts)
    return LocalView(
        t_s, pose, twist, ranges, ANGLES, mount, 20.0, goal, limits, JACKAL, tolerance_m, goal_is_sure=True
    )


def rest_of(
    controller: LocalController,
    goal: tuple[float, float],
    tolerance_m: float,
    limits: LocalLimits = LIMITS,
    seconds: float = 20.0,
) -> float:
    """How far from the goal it comes to rest after it said that it had arrived; inf where it never did."""
    true = Drive(
        limits.speed_m_s,
        limits.reverse_m_s,
        limits.acceleration_m_s2,
        limits.deceleration_m_s2,
        limits.turn_rate_rad_s,
        limits.turn_acceleration_rad_s2,
    )
    state = (0.0, 0.0, 0.0, 0.0, 0.0)
    late, commands = round(limits.delay_s / 0.05), [Twist(0.0, 0.0)] * 20
    stopping = 0
    for k in range(round(seconds / 0.05)):
        pose, twist = Pose2(*state[:3]), Twist(*state[3:])
        if not stopping:
            commands.append(controller.step(view_of(0.05 * k, pose, twist, goal, tolerance_m, limits=limits)))
            stopping = controller.status == "arrived"
        else:
            commands.append(Twist(0.0, 0.0))
            stopping += 1
        if stopping > 30:
            return math.hypot(state[0] - goal[0], state[1] - goal[1])
        acting = commands[-1 - late]
        for _ in range(5):
            state = advance(*state, acting.v_m_s, acting.w_rad_s, 0.01, true)
    return math.inf


@pytest.mark.parametrize("goal", [CORNER_OF_CELLS, BESIDE])
@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_each_comes_to_rest_within_two_centimetres(name: str, goal: tuple[float, float]) -> None:
    config = LOCAL_CONTROLLERS.configure(name, {}, name)
    controller = LOCAL_CONTROLLERS.entry(name).factory(config, np.random.default_rng(1))
    assert rest_of(controller, goal, 0.02) <= 0.02


def test_slow_robots_with_a_delay_do_as_well() -> None:
    slow = LocalLimits(0.5, 0.0, 0.3, 0.3, 1.0, 2.0, 0.1)
    config = LOCAL_CONTROLLERS.configure("gap-horizon", {}, "gap-horizon")
    controller = LOCAL_CONTROLLERS.entry("gap-horizon").factory(config, np.random.default_rng(1))
    assert rest_of(controller, BESIDE, 0.02, slow, seconds=40.0) <= 0.02


def scene_at(
    twist: Twist, goal: tuple[float, float], posts: FloatArray = NO_POSTS, limits: LocalLimits = LIMITS
) -> Scene:
    """The ground after one look from the origin."""
    view = view_of(0.0, Pose2(0.0, 0.0, 0.0), twist, goal, 0.02, posts, limits)
    return RollingGround(RollingConfig()).update(view)


def test_only_what_the_grid_does_not_resolve_is_fine() -> None:
    scene = scene_at(Twist(0.0, 0.0), (0.5, 0.0))
    assert is_fine(scene, 0.02)
    assert not is_fine(scene, 0.15)


def test_who_slides_through_its_goal_from_full_speed_is_led_to_it() -> None:
    weak = scene_at(Twist(0.0, 0.0), (0.5, 0.0), limits=LocalLimits(1.5, 0.5, 1.0, 1.0, 4.0, 6.0))
    assert not is_fine(weak, 0.25)
    assert is_led(weak, 0.25)
    slow = scene_at(Twist(0.0, 0.0), (0.5, 0.0), limits=LocalLimits(0.5, 0.5, 1.0, 1.0, 4.0, 6.0))
    assert not is_led(slow, 0.25)


@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_each_rests_within_a_tolerance_that_it_slides_through(name: str) -> None:
    """2 m from full speed with these brakes: they said that they had arrived as they came past."""
    limits = LocalLimits(1.6, 0.5, 1.0, 1.0, 3.0, 6.0)
    config = LOCAL_CONTROLLERS.configure(name, {}, name)
    controller = LOCAL_CONTROLLERS.entry(name).factory(config, np.random.default_rng(1))
    assert rest_of(controller, (3.0, 0.0), 0.25, limits, seconds=15.0) <= 0.25


def test_who_would_slide_out_has_not_arrived() -> None:
    assert rests_within(scene_at(Twist(0.0, 0.0), (0.005, 0.0)), 0.02)
    assert not rests_within(scene_at(Twist(0.5, 0.0), (0.005, 0.0)), 0.02)


def test_it_backs_to_what_lies_behind_and_turns_to_what_lies_beside() -> None:
    behind = approach(scene_at(Twist(0.0, 0.0), (-0.05, 0.0)), 0.02)
    assert behind is not None
    assert behind.v_m_s < 0.0
    assert behind.w_rad_s == pytest.approx(0.0, abs=1e-9)
    beside = approach(scene_at(Twist(0.0, 0.0), (0.0, -0.2)), 0.02)
    assert beside is not None
    assert beside.v_m_s == 0.0
    assert beside.w_rad_s < 0.0
    no_reverse = LocalLimits(2.0, 0.0, 3.0, 3.0, 4.0, 6.0)
    turned = approach(scene_at(Twist(0.0, 0.0), (-0.2, 0.01), limits=no_reverse), 0.02)
    assert turned is not None
    assert turned.v_m_s == 0.0
    assert turned.w_rad_s > 0.0


def test_it_faces_a_goal_behind_on_ground_that_it_has_not_seen() -> None:
    """It turned its back on it, could not back, and plans turned it to face it: to and fro for 45 s."""
    ground, goal, limits = (
        RollingGround(RollingConfig()),
        (-0.05, -0.55),
        LocalLimits(1.0, 0.3, 2.0, 2.0, 2.0, 8.0),
    )
    outline, middle = polygon_around(Footprint.disc(0.147)), Pose2(0.0, 0.0, 0.0)
    poses = [(-0.026, -0.068, 1.3), (0.035, -0.291, 1.79), (0.035, -0.291, 1.71), (0.035, -0.291, 1.54)]
    for k, pose in enumerate(poses):
        still = Twist(0.0, 0.0)
        view = view_of(0.1 * k, Pose2(*pose), still, goal, 0.05, limits=limits, mount=middle)
        scene = ground.update(replace(view, footprint_xy_m=outline))
    facing = approach(scene, 0.05)
    assert facing is not None
    assert facing.v_m_s == 0.0
    assert abs(facing.w_rad_s) > 1.0


def test_where_the_arc_is_not_safe_it_turns_on_until_the_line_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """It turned until it could begin the arc, could not, and was turned away again by its plans."""
    monkeypatch.setattr(
        "pilotage.stack.control.local.fine_goal.is_safe",
        lambda scene, one: one.v_m_s * one.w_rad_s == 0.0 and is_safe(scene, one),
    )
    for goal in (
        (0.28 * math.cos(0.3), 0.28 * math.sin(0.3)),
        (-0.06 * math.cos(0.3), -0.06 * math.sin(0.3)),
    ):
        turning = approach(scene_at(Twist(0.0, 0.0), goal), 0.02)
        assert turning is not None
        assert turning.v_m_s == 0.0
        assert turning.w_rad_s == pytest.approx(0.9, abs=0.01)
    straight = approach(scene_at(Twist(0.0, 0.0), (0.28, 0.0)), 0.02)
    assert straight is not None
    assert straight.v_m_s > 0.0


def test_it_is_no_approach_from_afar_nor_past_a_post() -> None:
    assert approach(scene_at(Twist(0.0, 0.0), (1.5, 0.0)), 0.02) is None
    near = np.array([[0.55, 0.0, 0.1]])
    assert approach(scene_at(Twist(0.0, 0.0), (0.28, 0.0)), 0.02) is not None
    assert approach(scene_at(Twist(0.0, 0.0), (0.28, 0.0), near), 0.02) is None


class Recorded:
    """A controller that keeps what it is shown."""

    status = "driving"

    def __init__(self) -> None:
        self.views: list[LocalView] = []

    def step(self, view: LocalView) -> Twist:
        self.views.append(view)
        return Twist(0.0, 0.0)


@pytest.mark.parametrize(
    ("tolerance_m", "std_m", "moved_m", "moves", "sure"),
    [
        (0.02, 1e-3, 0.005, True, True),
        (0.02, 0.05, 0.005, False, False),
        (0.02, 0.05, 0.03, True, False),
        (0.3, 1e-3, 0.03, False, False),
    ],
)
def test_a_goal_is_placed_anew_as_finely_as_it_has_to_be_met(
    tolerance_m: float, std_m: float, moved_m: float, moves: bool, sure: bool
) -> None:
    """A belief that moves while the odometry does not; where it is surer than the tolerance, always."""
    controller, robot = Recorded(), told_of().robot
    drive = LocalDrive(controller, robot, Pose2(0.0, 0.0, 0.0), reverse_m_s=0.2, needed_by="test")
    ranges = np.full(robot.one_sensor(LidarConfig, "test")[1].beams, 5.0)
    for t_s, x_m in ((0.1, 0.0), (0.2, moved_m)):
        belief = Belief(Pose2(x_m, 0.0, 0.0), np.diag([std_m**2, std_m**2, 1e-6]))
        readings = Readings(t_s, {"lidar": LidarScan(ranges), "odometry": OdometryIncrement(0.0, 0.0)})
        drive.toward((0.5, 0.0), belief, readings, tolerance_m)
    first, second = controller.views
    assert (first.goal_xy_m != second.goal_xy_m) == moves
    assert second.goal_is_sure == sure


def test_a_controller_is_told_how_noisy_its_measured_speed_is() -> None:
    """Of 0.1 m and 0.05 rad in a tenth of a second."""
    controller, robot = Recorded(), told_of().robot
    drive = LocalDrive(controller, robot, Pose2(0.0, 0.0, 0.0), reverse_m_s=0.2, needed_by="test")
    wheels = robot.one_sensor(WheelOdometryConfig, "test")[1]
    ranges = np.full(robot.one_sensor(LidarConfig, "test")[1].beams, 5.0)
    readings = Readings(0.1, {"lidar": LidarScan(ranges), "odometry": OdometryIncrement(0.1, 0.05)})
    drive.move(readings)
    drive.toward((0.5, 0.0), Belief(Pose2(0.1, 0.0, 0.05), 1e-6 * np.eye(3)), readings, 0.3)
    (view,) = controller.views
    assert view.twist.v_m_s == pytest.approx(1.0)
    assert view.speed_var_m2_s2 == pytest.approx(wheels.distance_var_m2_per_m * 0.1 / 0.1**2)
    angle_var = wheels.angle_var_rad2_per_rad * 0.05 + wheels.angle_var_rad2_per_m * 0.1
    assert view.turn_rate_var_rad2_s2 == pytest.approx(angle_var / 0.1**2)


def test_a_sure_goal_stays_where_the_odometry_has_it() -> None:
    """The controller's own matching may have moved; a goal that is not sure moves with it."""
    grounds = [RollingGround(RollingConfig()) for _ in range(2)]
    for k in range(40):
        x_m = 0.03 * k
        view = view_of(0.05 * k, Pose2(x_m, 0.0, 0.0), Twist(0.6, 0.0), (2.0, 0.0), 0.02)
        sure, unsure = (
            ground.update(replace(view, goal_is_sure=sure))
            for ground, sure in zip(grounds, (True, False), strict=True)
        )
    assert sure.distance_m == pytest.approx(2.0 - x_m, abs=1e-9)
    assert unsure.distance_m != pytest.approx(2.0 - x_m, abs=1e-3)
