"""Every registered local controller in a small closed loop, and what our own one promises."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.footprint import discs_clearance
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.stack.control.local.blind_side import blind_clearance_m
from pilotage.stack.control.local.command_check import (
    MARGIN_M,
    footprint_clearance_m,
    is_safe,
)
from pilotage.stack.control.local.gap_horizon import GapHorizon
from pilotage.stack.control.local.narrow_passage import NarrowPassage, find_narrow_passage
from pilotage.stack.control.local.role import (
    LOCAL_CONTROLLERS,
    LocalController,
    LocalLimits,
    LocalView,
)
from pilotage.stack.control.local.rolling import RollingGround, Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.turning_room import find_turning_room

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
LIMITS = LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
ANGLES = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 271)
MOUNT = Pose2(0.12, 0.0, 0.0)
NO_SEGMENTS = np.zeros((0, 4))
POSTS = np.array([[2.0, 0.1, 0.075], [3.0, 0.9, 0.075], [3.0, -0.8, 0.075], [4.2, -0.1, 0.2]])


def view_of(
    t: float,
    pose: Pose2,
    twist: Twist,
    circles: FloatArray,
    limits: LocalLimits = LIMITS,
    tolerance_m: float = 0.3,
    angles: FloatArray = ANGLES,
) -> LocalView:
    """What a robot with true odometry and a perfect laser sees; the goal is 6 m ahead."""
    x = pose.x_m + math.cos(pose.theta_rad) * MOUNT.x_m
    y = pose.y_m + math.sin(pose.theta_rad) * MOUNT.x_m
    step = float(angles[1] - angles[0])
    ranges = fan_ranges(
        x, y, pose.theta_rad + float(angles[0]), step, angles.shape[0], 20.0, NO_SEGMENTS, circles
    )
    return LocalView(t, pose, twist, ranges, angles, MOUNT, 20.0, (6.0, 0.0), limits, JACKAL, tolerance_m)


def drive(
    controller: LocalController,
    circles: FloatArray,
    limits: LocalLimits = LIMITS,
    true_share: float = 1.0,
    seconds: float = 15.0,
    tolerance_m: float = 0.3,
    angles: FloatArray = ANGLES,
) -> tuple[bool, float, list[Twist]]:
    """Whether it came to the goal, its least clearance, and its commands; with the delay of the limits."""
    true = Drive(
        limits.speed_m_s,
        limits.reverse_m_s,
        limits.acceleration_m_s2 * true_share,
        limits.deceleration_m_s2 * true_share,
        limits.turn_rate_rad_s,
        limits.turn_acceleration_rad_s2 * true_share,
    )
    x, y, theta, v, w = 0.0, 0.0, 0.0, 0.0, 0.0
    least = math.inf
    commands: list[Twist] = []
    late = round(limits.delay_s / 0.05)
    for k in range(round(seconds / 0.05)):
        view = view_of(0.05 * k, Pose2(x, y, theta), Twist(v, w), circles, limits, tolerance_m, angles)
        commands.append(controller.step(view))
        acting = commands[-1 - late] if len(commands) > late else Twist(0.0, 0.0)
        for _ in range(5):
            x, y, theta, v, w = advance(x, y, theta, v, w, acting.v_m_s, acting.w_rad_s, 0.01, true)
            least = min(least, discs_clearance(x, y, theta, JACKAL, circles))
        if math.hypot(x - 6.0, y) < 1.2 * tolerance_m:
            return True, least, commands
    return False, least, commands


def make(name: str, seed: int = 1, **parameters: object) -> LocalController:
    """A controller by its name."""
    config = LOCAL_CONTROLLERS.configure(name, dict(parameters), name)
    return LOCAL_CONTROLLERS.entry(name).factory(config, np.random.default_rng(seed))


def test_all_are_registered() -> None:
    assert {"dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"} <= set(LOCAL_CONTROLLERS.names())


@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_each_drives_around_posts(name: str) -> None:
    arrived, least, commands = drive(make(name), POSTS)
    assert arrived
    assert least > 0.0
    for command in commands:
        assert -LIMITS.reverse_m_s - 1e-9 <= command.v_m_s <= LIMITS.speed_m_s + 1e-9
        assert abs(command.w_rad_s) <= LIMITS.turn_rate_rad_s + 1e-9


@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_a_slow_robot_keeps_away_from_the_end_of_a_wall(name: str) -> None:
    """No place is too narrow to be driven at 0.3 m/s: the way leads clear of obstacles all the same."""
    slow = LocalLimits(0.3, 0.1, 0.5, 0.5, 1.5, 3.0)
    y = np.arange(-4.0, 0.05, 0.1)
    wall = np.column_stack([np.full(y.shape[0], 2.0), y, np.full(y.shape[0], 0.075)])
    arrived, least, _ = drive(make(name), wall, slow, seconds=40.0)
    assert arrived
    assert least > 0.05


@pytest.mark.parametrize("half_width_m", [0.5, 0.7])
@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_no_controller_backs_into_what_its_laser_does_not_see(name: str, half_width_m: float) -> None:
    """In a pocket that is open behind, with a post there; the laser sees the half before the robot."""
    x = np.arange(-0.5, 1.3, 0.1)
    sides = [
        np.column_stack([x, np.full(x.shape[0], side * half_width_m), np.full(x.shape[0], 0.05)])
        for side in (-1.0, 1.0)
    ]
    y = np.arange(-0.7, 0.75, 0.1)
    front = np.column_stack([np.full(y.shape[0], 1.0), y, np.full(y.shape[0], 0.05)])
    behind = np.array([[-0.9, 0.0, 0.1]])
    half = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 181)
    slow = LocalLimits(0.3, 0.2, 0.5, 0.5, 1.5, 3.0)
    _, least, _ = drive(make(name), np.vstack([*sides, front, behind]), slow, seconds=20.0, angles=half)
    assert least > 0.0


@pytest.mark.parametrize("name", ["mppi", "gap-horizon"])
def test_samplers_repeat_with_their_generator(name: str) -> None:
    first = drive(make(name, seed=4), POSTS, seconds=1.0)[2]
    again = drive(make(name, seed=4), POSTS, seconds=1.0)[2]
    other = drive(make(name, seed=5), POSTS, seconds=1.0)[2]
    assert first == again
    assert first != other


@pytest.mark.parametrize("seed", range(4))
def test_our_own_hits_nothing_it_has_seen_with_weak_brakes_worse_than_told(seed: int) -> None:
    """Random posts, some of which leave no way: it may stand still, it may not touch."""
    rng = np.random.default_rng(seed)
    places = rng.uniform([1.2, -2.0], [5.2, 2.0], (14, 2))
    circles = np.column_stack([places, np.full(14, 0.1)])
    weak = LocalLimits(2.0, 0.5, 1.0, 1.0, 4.0, 6.0, 0.1)
    _, least, _ = drive(make("gap-horizon"), circles, weak, true_share=0.75, seconds=12.0)
    assert least > 0.0


@pytest.mark.parametrize("seed", range(4))
def test_vfh_sends_nothing_that_its_brakes_cannot_follow(seed: int) -> None:
    """Fast between posts, with weak brakes: told to creep and turn it is fast yet, and sweeps into one."""
    rng = np.random.default_rng(seed)
    weak, told = LocalLimits(1.2, 0.3, 0.9, 0.9, 1.4, 5.0), []
    for _ in range(25):
        places = rng.uniform([0.5, -1.5], [3.0, 1.5], (6, 2))
        posts = np.column_stack([places, np.full(6, 0.1)])
        twist = Twist(rng.uniform(0.6, 1.2), rng.uniform(-1.0, 1.0))
        view = view_of(0.0, Pose2(0.0, 0.0, 0.0), twist, posts, weak)
        view = replace(view, goal_xy_m=(rng.uniform(-2.0, 4.0), rng.uniform(-3.0, 3.0)))
        command = make("vfh").step(view)
        scene = RollingGround(RollingConfig()).update(view)
        assert command == Twist(0.0, 0.0) or is_safe(scene, command, 0.8 * MARGIN_M)
        told.append(abs(command.v_m_s) > 0.05)
    assert any(told), "it drives where it can"


@pytest.mark.parametrize("radius_m", [0.25, 0.3])
def test_a_round_robot_turns_where_it_stands_however_near_a_wall_is_told_to_be(radius_m: float) -> None:
    """By a vague laser it already touches; the corners that stand for its disc would swing into that."""
    angles = 2.0 * np.pi * np.arange(16) / 16
    disc = radius_m / math.cos(math.pi / 16) * np.column_stack([np.cos(angles), np.sin(angles)])
    wall = np.array([[radius_m + 0.01, 0.02 * k - 0.1, 0.02] for k in range(11)])
    turn, ahead = Twist(0.0, 1.0), Twist(0.2, 0.0)
    square = radius_m * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    for outline, allowed in ((disc, True), (square, False)):
        ground = RollingGround(RollingConfig())
        view = replace(view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), wall), footprint_xy_m=outline)
        scene = ground.update(view)
        assert footprint_clearance_m(scene, 0.0, 0.0, 0.0, 0.1) < 0.0
        assert is_safe(scene, turn) == allowed
        assert not is_safe(scene, ahead)


@pytest.mark.parametrize("y", [-0.1, 0.12])
def test_our_own_steers_around_what_it_can_no_longer_brake_for(y: float) -> None:
    """A post that comes to light 0.95 m before a robot that needs 1.6 m to stop."""
    limits = LocalLimits(2.0, 0.5, 1.2, 1.2, 4.0, 6.0)
    post = np.array([[3.0, y, 0.05]])
    true = Drive(2.0, 0.5, 1.2, 1.2, 4.0, 6.0)
    controller = make("gap-horizon")
    state = 0.0, 0.0, 0.0, 0.0, 0.0
    least = math.inf
    fastest = 0.0
    for k in range(120):
        x, _, theta, v, w = state
        hidden = x + 0.254 + 0.95 < 3.0
        fastest = v if hidden else fastest
        view = view_of(
            0.05 * k, Pose2(x, state[1], theta), Twist(v, w), np.zeros((0, 3)) if hidden else post, limits
        )
        command = controller.step(view)
        for _ in range(5):
            state = advance(*state, command.v_m_s, command.w_rad_s, 0.01, true)
            least = min(least, discs_clearance(*state[:3], JACKAL, post))
    assert fastest > 1.6
    assert least > 0.0


@pytest.mark.parametrize("seed", [1, 10])
def test_our_own_goes_on_to_a_goal_that_has_to_be_met_closely(seed: int) -> None:
    """Plans of a second alone stand still before it more often; longer ones come within 5 cm."""
    slow = LocalLimits(0.5, 0.2, 0.5, 0.5, 1.0, 2.0)
    arrived, _, _ = drive(make("gap-horizon", seed), POSTS[2:], slow, seconds=30.0, tolerance_m=0.05)
    assert arrived


def test_with_a_post_closer_than_it_can_measure_it_drives_slowly() -> None:
    """A belief that is a centimetre off may have the wrong side as the near one."""

    def speed(room_m: float) -> float:
        posts = np.array([[0.0, 0.215 + room_m + 0.075, 0.075]])
        return make("gap-horizon").step(view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), posts)).v_m_s

    assert 0.1 < speed(0.005) <= 0.35
    assert speed(0.05) > 0.5


def test_lining_up_before_a_gap_it_swings_no_corner_by_more_closely_than_elsewhere() -> None:
    """A front corner would pass a post by 3 mm on its way round to the point before a gap on the left."""
    away = math.hypot(0.254, 0.215) + 0.003 + 0.075
    posts = np.array([[away * math.cos(-0.2), away * math.sin(-0.2), 0.075]])
    controller = make("gap-horizon")
    assert isinstance(controller, GapHorizon)
    controller._passage, controller._bound_for = (
        NarrowPassage(0.6, 1.0, 0.0, 0.5, 0, 0.0),
        np.array([6.0, 0.0]),
    )
    state = (0.0, 0.0, 0.0, 0.0, 0.0)
    true = Drive(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
    least = math.inf
    for k in range(30):
        command = controller.step(view_of(0.05 * k, Pose2(*state[:3]), Twist(*state[3:]), posts))
        state = advance(*state, command.v_m_s, command.w_rad_s, 0.05, true)
        least = min(least, discs_clearance(*state[:3], JACKAL, posts))
    assert state[2] > 0.1
    assert least > 0.0045


@pytest.mark.parametrize("room_m", [0.012, 0.02])
def test_where_a_post_keeps_it_from_turning_it_backs_straight_out(room_m: float) -> None:
    """The point before the gap is to its left; it has come in between four posts, and any turn meets one."""
    away = 0.215 + room_m + 0.075
    posts = np.array([[x, side * away, 0.075] for x in (0.0, 0.12) for side in (-1.0, 1.0)])
    controller = make("gap-horizon")
    assert isinstance(controller, GapHorizon)
    for k in range(20):
        controller.step(view_of(0.05 * k - 1.0, Pose2(0.05 * k - 1.0, 0.0, 0.0), Twist(1.0, 0.0), posts))
    controller._passage, controller._bound_for = (
        NarrowPassage(0.6, 1.0, 0.0, 0.5, 0, 0.0),
        np.array([6.0, 0.0]),
    )
    state = (0.0, 0.0, 0.0, 0.0, 0.0)
    true = Drive(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
    least = math.inf
    for k in range(80):
        command = controller.step(view_of(0.05 * k, Pose2(*state[:3]), Twist(*state[3:]), posts))
        state = advance(*state, command.v_m_s, command.w_rad_s, 0.05, true)
        least = min(least, discs_clearance(*state[:3], JACKAL, posts))
    # Backed out, turned, and on its way.
    assert state[0] < -0.3
    assert state[2] > 1.0
    assert least > 0.0


def test_what_its_laser_does_not_see_is_told_from_what_it_sees() -> None:
    """A post that was seen from the front, and stands 1 cm behind the corner after the robot has turned."""
    post = np.array([[-0.33, -0.225, 0.075]])
    ground = RollingGround(RollingConfig())
    ground.update(view_of(0.0, Pose2(0.0, 0.0, math.pi), Twist(0.0, 0.0), post))
    behind = view_of(0.05, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), post)
    room_m = blind_clearance_m(behind, ground.update(behind), 0.02)
    assert room_m == pytest.approx(discs_clearance(0.0, 0.0, 0.0, JACKAL, post), abs=0.01)
    assert room_m < 0.02
    beside = np.array([[0.1, -0.305, 0.075]])
    view = view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), beside)
    assert discs_clearance(0.0, 0.0, 0.0, JACKAL, beside) < 0.02
    assert blind_clearance_m(view, RollingGround(RollingConfig()).update(view), 0.02) == 0.02


def test_posts_that_all_but_touch_are_no_gap_to_try() -> None:
    """Two rows of posts with 6 cm between: nothing to line up for."""
    posts = np.array(
        [[0.7, side * (0.03 + 0.075 + 0.15 * k), 0.075] for k in range(3) for side in (-1.0, 1.0)]
    )
    scene = RollingGround(RollingConfig()).update(view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), posts))
    straight = replace(scene, path=np.column_stack([np.arange(0.0, 1.2, 0.1), np.zeros(12)]))
    assert find_narrow_passage(straight, 1.2, 0.0) is None
    wider = posts + np.sign(posts[:, 1:2]) * [0.0, 0.22, 0.0]
    scene = RollingGround(RollingConfig()).update(view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), wider))
    assert find_narrow_passage(replace(scene, path=straight.path), 1.2, 0.0) is not None


@pytest.mark.parametrize("shift_m", [0.0, 0.012, 0.024, 0.036])
def test_the_middle_between_two_wall_ends_is_found_wherever_cells_lie(shift_m: float) -> None:
    """The mean of the cell that a wall ends in is up to 2.5 cm from its end, on either side another way."""
    rng = np.random.default_rng(5)
    right, left = -0.23 + shift_m, 0.26 + shift_m
    walls = np.array([[0.8, -2.0, 0.8, right], [0.8, left, 0.8, 2.0]])
    ground = RollingGround(RollingConfig())
    passage = NarrowPassage(0.8, 0.5 * (left + right) + 0.02, 0.0, 0.5, 2, 0.0)
    angles = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 720)
    step = float(angles[1] - angles[0])
    for k in range(60):
        ranges = fan_ranges(
            MOUNT.x_m, 0.0, float(angles[0]), step, len(angles), 20.0, walls, np.zeros((0, 3))
        )
        ranges = ranges + rng.normal(0.0, 0.01, len(angles)) * (ranges < 20.0)
        view = LocalView(
            0.05 * k,
            Pose2(0.0, 0.0, 0.0),
            Twist(0.0, 0.0),
            ranges,
            angles,
            MOUNT,
            20.0,
            (6.0, 0.0),
            LIMITS,
            JACKAL,
        )
        scene = ground.update(view)
        seen = ranges < 20.0
        points = np.column_stack([np.cos(angles), np.sin(angles)])[seen] * ranges[seen, None] + [
            MOUNT.x_m,
            0.0,
        ]
        after, _ = passage.step(scene, points + scene.pose[:2], view.t_s)
        assert after is not None
        passage = after
    # On the axis, where it meets the walls.
    along = 0.8 - passage.x_m
    y = passage.y_m + along * math.tan(passage.direction_rad)
    assert abs(y - 0.5 * (left + right)) < 0.008


def test_the_least_margin_holds_from_the_gap_on_and_what_proves_closed_is_left() -> None:
    """Straight, but half a metre before the gap, it passes posts that are none of the gap's."""
    gap = np.array([[0.8, side * (0.24 + 0.075), 0.075] for side in (-1.0, 1.0)])

    def scene_at(x: float) -> Scene:
        ground = RollingGround(RollingConfig())
        return ground.update(view_of(0.0, Pose2(x, 0.0, 0.0), Twist(0.0, 0.0), gap))

    passage = NarrowPassage(0.8, 0.0, 0.0, 0.48, 2, 0.0)
    assert not passage.goes_in(scene_at(0.3))
    assert passage.goes_in(scene_at(0.5))
    assert not replace(passage, stage=1).goes_in(scene_at(0.5))
    nothing = np.zeros((0, 2))
    assert passage.step(scene_at(0.9), nothing, 1.0)[0] is not None
    assert replace(passage, width_m=0.05).step(scene_at(0.9), nothing, 1.0)[0] is None


def test_a_robot_that_cannot_turn_where_it_stands_gets_room_first() -> None:
    """A post beside its rear, its way behind it: plans of a second and a half stood there, turn and all."""
    beside = np.array([[-0.09, -0.41, 0.075]])
    scene = RollingGround(RollingConfig()).update(view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), beside))
    back = replace(scene, path=np.column_stack([np.arange(0.0, -2.0, -0.1), np.zeros(20)]))
    room_m = scene.body.outer_m + 0.03
    assert find_turning_room(scene, room_m, 0.015, 0.0) is None  # its way lies ahead
    found = find_turning_room(back, room_m, 0.015, 0.0)
    assert found is not None
    assert 0.0 < found.x_m < 0.3
    _, command = found.step(back, room_m, 0.1)
    assert command.v_m_s > 0.05
    assert command.w_rad_s == 0.0
    there = replace(back, start=np.array([found.x_m, found.y_m, 0.0, 0.0, 0.0]))
    then, command = found.step(there, room_m, 1.0)
    assert command.v_m_s == 0.0
    assert abs(command.w_rad_s) > 0.5
    assert then is not None
    assert (
        then.step(replace(there, start=np.array([found.x_m, found.y_m, 3.0, 0.0, 0.0])), room_m, 2.0)[0]
        is None
    )
    # A wall before it and one behind leave none.
    y = np.arange(-0.5, 0.5, 0.02)
    walls = [np.column_stack([np.full(y.shape, x), y, np.full(y.shape, 0.01)]) for x in (0.3, -0.3)]
    scene = RollingGround(RollingConfig()).update(
        view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), np.vstack([beside, *walls]))
    )
    assert find_turning_room(replace(scene, path=back.path), room_m, 0.015, 0.0) is None


def test_it_does_not_go_into_a_gap_askew() -> None:
    """Three centimetres off the axis, or at an angle, a corner meets what it is to pass between."""
    gap = np.array([[0.8, side * (0.24 + 0.075), 0.075] for side in (-1.0, 1.0)])

    def goes(y: float, theta: float) -> bool:
        scene = RollingGround(RollingConfig()).update(
            view_of(0.0, Pose2(0.45, y, theta), Twist(0.0, 0.0), gap)
        )
        _, command = NarrowPassage(0.8, 0.0, 0.0, 0.48, 2, 0.0).command(scene)
        return command != Twist(0.0, 0.0)

    assert goes(0.0, 0.0)
    assert not goes(0.03, 0.0)
    assert not goes(0.0, 0.1)


def test_it_stands_before_a_closed_wall() -> None:
    y = np.arange(-4.5, 4.6, 0.15)
    wall = np.column_stack([np.full(y.shape[0], 2.5), y, np.full(y.shape[0], 0.08)])
    sides = np.column_stack([np.arange(-2.0, 2.6, 0.15), np.full(31, 4.5), np.full(31, 0.08)])
    back = np.column_stack([np.full(y.shape[0], -2.0), y, np.full(y.shape[0], 0.08)])
    room = np.vstack([wall, sides, sides * [1.0, -1.0, 1.0], back])
    arrived, least, _ = drive(make("gap-horizon"), room, seconds=6.0)
    assert not arrived
    assert least > 0.0


def test_a_covered_laser_stops_it() -> None:
    controller = make("gap-horizon")
    view = view_of(0.0, Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0), POSTS)
    covered = LocalView(
        0.0,
        view.pose,
        view.twist,
        np.zeros_like(view.ranges_m),
        ANGLES,
        MOUNT,
        20.0,
        (6.0, 0.0),
        LIMITS,
        JACKAL,
    )
    assert controller.step(covered) == Twist(0.0, 0.0)


def test_bad_views_are_refused_in_one_line() -> None:
    pose, twist = Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.0)
    with pytest.raises(InputError, match="as many ranges"):
        LocalView(0.0, pose, twist, np.ones(5), ANGLES, MOUNT, 20.0, (6.0, 0.0), LIMITS, JACKAL)
    with pytest.raises(InputError, match="evenly"):
        LocalView(
            0.0, pose, twist, np.ones(3), np.array([0.0, 0.1, 0.5]), MOUNT, 20.0, (6.0, 0.0), LIMITS, JACKAL
        )
    with pytest.raises(InputError, match="deceleration_m_s2"):
        LocalLimits(2.0, 0.5, 3.0, 0.0, 4.0, 6.0)
    with pytest.raises(InputError, match="delay_s"):
        LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0, -0.1)
    controller = make("gap-horizon")
    view = view_of(1.0, pose, twist, POSTS)
    controller.step(view)
    with pytest.raises(InputError, match=r"after 1\.000 s"):
        controller.step(view)
    with pytest.raises(InputError, match="did you mean 'gap-horizon'"):
        LOCAL_CONTROLLERS.entry("gap-horizn")


@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
@pytest.mark.parametrize("speed_m_s", [0.7, 0.8, 0.9])
def test_each_arrives_with_rates_that_change_at_once(name: str, speed_m_s: float) -> None:
    """Beside its goal the window's one turned round and round: from there any direction leads down."""
    quick = LocalLimits(speed_m_s, 0.5, 10.0 * speed_m_s, 10.0 * speed_m_s, 2.3, 23.0)
    arrived, _, commands = drive(make(name), POSTS[3:], quick, tolerance_m=0.15)
    assert arrived
    assert len(commands) < 1.5 * 6.0 / speed_m_s / 0.05
