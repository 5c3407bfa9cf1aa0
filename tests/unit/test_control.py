"""Followers, reactions and escapes: signs, thresholds, ends."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.maps.near_walls import NearWalls
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.readings import Readings, UltrasonicReading
from pilotage.stack.control.back_out import BackOut, BackOutConfig
from pilotage.stack.control.guard import ArcGuard, GuardConfig
from pilotage.stack.control.pi_follower import PiFollower, PiFollowerConfig
from pilotage.stack.control.reactive import Reaction, ReactionKind
from pilotage.stack.control.ultrasonic_reaction import UltrasonicReaction, UltrasonicReactionConfig
from support.models import move
from support.robots import told_of

NOTHING = NearWalls(np.zeros((0, 4)))
NO_CIRCLES: FloatArray = np.zeros((0, 3))


def sonar(front: float | None, left: float | None, right: float | None) -> Readings:
    """Readings of the three ultrasonic sensors; None is saturated."""
    near = {"front": front, "left": left, "right": right}
    return Readings(
        0.1, {name: UltrasonicReading(3.0 if d is None else d, d is None) for name, d in near.items()}
    )


def react(config: UltrasonicReactionConfig, *readings: Readings, straight: bool = True) -> Reaction:
    """The reaction to the last of some readings."""
    reaction = UltrasonicReaction(config, told_of().robot)
    out = None
    for reading in readings:
        out = reaction.step(reading, Pose2(5.0, 5.0, 0.0), NOTHING, NO_CIRCLES, straight)
    assert out is not None
    return out


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pi_follower_turns_towards_the_reference(side: float) -> None:
    follower = PiFollower(PiFollowerConfig(), told_of().robot)
    follower.step(Pose2(0.0, 0.0, 0.0), Pose2(0.1, 0.0, 0.0), Twist(0.5, 0.0))
    control = follower.step(Pose2(0.05, 0.0, 0.0), Pose2(0.5, side * 0.2, 0.0), Twist(0.5, 0.0))
    assert control.error_m == pytest.approx(side * 0.2)
    assert control.proportional_rad_s == pytest.approx(side * 0.6 * 0.2)
    assert control.integral_rad_s == pytest.approx(side * 0.0025 * 0.2)
    assert control.twist.w_rad_s == pytest.approx(side * (0.12 + 0.0005))


def test_pi_follower_distance_is_that_of_the_report() -> None:
    # Eq. 15-16 in numbers: line through (0, 0) and (1, 1), point (1, 0).
    follower = PiFollower(PiFollowerConfig(), told_of().robot)
    follower.step(Pose2(0.0, 0.0, 0.7), Pose2(0.0, 0.0, 0.0), Twist(0.5, 0.0))
    control = follower.step(Pose2(1.0, 1.0, 0.7), Pose2(1.0, 0.0, 0.0), Twist(0.5, 0.0))
    assert control.error_m == pytest.approx(-math.sqrt(0.5))


def test_pi_follower_integral_is_bounded() -> None:
    config = PiFollowerConfig(integral_limit_rad_s=0.05)
    follower = PiFollower(config, told_of().robot)
    for _ in range(2000):
        control = follower.step(Pose2(0.0, 0.0, 0.0), Pose2(1.0, 5.0, 0.0), Twist(0.5, 0.0))
    assert control.integral_rad_s == pytest.approx(0.05)
    follower.reset()
    assert follower.step(Pose2(0, 0, 0), Pose2(1, 0, 0), Twist(0.5, 0.0)).integral_rad_s == 0.0


def test_lateral_objects_push_away_in_proportion() -> None:
    config = UltrasonicReactionConfig()
    near_left = react(config, sonar(None, 0.6, None))
    assert near_left.kind is ReactionKind.LATERAL
    assert near_left.w_rad_s == pytest.approx(-0.4 * (1.0 - 0.6))
    assert react(config, sonar(None, None, 0.6)).w_rad_s == pytest.approx(0.4 * (1.0 - 0.6))
    assert react(config, sonar(None, 1.5, None)).kind is ReactionKind.NONE


def test_a_hall_is_centred_only_where_the_plan_goes_straight() -> None:
    config = UltrasonicReactionConfig()
    off_to_the_right = sonar(None, 1.6, 0.6)
    hall = react(config, off_to_the_right)
    assert hall.kind is ReactionKind.HALL
    assert hall.w_rad_s > 0.0
    assert react(config, off_to_the_right, straight=False).kind is ReactionKind.LATERAL


def test_frontal_objects_turn_to_the_freer_side_and_keep_to_it() -> None:
    config = UltrasonicReactionConfig()
    left = react(config, sonar(0.8, 2.0, 1.0))
    assert (left.kind, left.w_rad_s) == (ReactionKind.AVOID, 0.5)
    assert react(config, sonar(0.8, 1.0, 2.0)).w_rad_s == -0.5
    kept = react(config, sonar(0.8, 1.0, 2.0), sonar(0.7, 2.0, 1.0))
    assert kept.w_rad_s == -0.5
    # Once begun, it ends only beyond the release distance.
    assert react(config, sonar(0.8, None, None), sonar(1.1, None, None)).kind is ReactionKind.AVOID
    assert react(config, sonar(0.8, None, None), sonar(1.3, None, None)).kind is ReactionKind.NONE
    assert react(config, sonar(1.1, None, None)).kind is ReactionKind.NONE


def test_saturated_readings_are_no_walls() -> None:
    assert react(
        UltrasonicReactionConfig(frontal_below_m=3.5, release_above_m=4.0), sonar(None, None, None)
    ).kind is (ReactionKind.NONE)


def test_turning_without_a_way_out_is_a_trap() -> None:
    stuck = [sonar(0.5, 0.6, 0.6)] * 60
    assert react(UltrasonicReactionConfig(), *stuck).kind is ReactionKind.TRAPPED


def test_mapped_walls_need_no_avoidance_unless_asked() -> None:
    wall = NearWalls(np.array([[6.0, 0.0, 6.0, 10.0]]))
    reading = sonar(0.8, None, None)
    pose = Pose2(5.0, 5.0, 0.0)
    wise = UltrasonicReaction(UltrasonicReactionConfig(), told_of().robot)
    assert wise.step(reading, pose, wall, NO_CIRCLES, False).kind is ReactionKind.NONE
    reports = UltrasonicReaction(UltrasonicReactionConfig(ignore_mapped=False), told_of().robot)
    assert reports.step(reading, pose, wall, NO_CIRCLES, False).kind is ReactionKind.AVOID


def test_release_below_the_trigger_is_refused() -> None:
    config = UltrasonicReactionConfig(frontal_below_m=1.0, release_above_m=0.5)
    with pytest.raises(InputError, match="release_above_m"):
        UltrasonicReaction(config, told_of().robot)


def test_backing_out_follows_the_trail_in_reverse() -> None:
    trail = [Pose2(0.05 * i, 0.1 * math.sin(0.1 * i), 0.0) for i in range(100)]
    escape = BackOut(BackOutConfig(distance_m=2.0), told_of().robot)
    last, before = trail[-1], trail[-2]
    pose = Pose2(last.x_m, last.y_m, math.atan2(last.y_m - before.y_m, last.x_m - before.x_m))
    escape.begin(list(trail))
    driven = 0.0
    for _ in range(1000):
        command = escape.step(pose)
        if command is None:
            break
        assert command.v_m_s < 0.0
        driven -= command.v_m_s * 0.1
        pose = move(pose, command.v_m_s * 0.1, command.w_rad_s * 0.1, OdometryModel.EXACT_ARC)
        assert min(math.hypot(p.x_m - pose.x_m, p.y_m - pose.y_m) for p in trail) < 0.05
        assert abs(wrap_to_pi(pose.theta_rad)) < 0.6
    assert driven == pytest.approx(2.0, abs=0.1)


def test_backing_out_without_a_trail_turns_on_the_spot() -> None:
    escape = BackOut(BackOutConfig(turn_rad=1.2, turn_limit_rad_s=0.6), told_of().robot)
    escape.begin([])
    commands = [escape.step(Pose2(0, 0, 0)) for _ in range(21)]
    assert commands[-1] is None
    turned = sum(0.1 * command.w_rad_s for command in commands if command is not None)
    assert turned == pytest.approx(1.2)
    assert all(command.v_m_s == 0.0 for command in commands if command is not None)


def test_a_second_escape_starts_where_the_first_one_ended() -> None:
    trail = [Pose2(0.05 * i, 0.0, 0.0) for i in range(200)]
    escape = BackOut(BackOutConfig(distance_m=2.0), told_of().robot)
    pose = trail[-1]
    for _ in range(2):
        escape.begin(trail)
        while (command := escape.step(pose)) is not None:
            pose = move(pose, command.v_m_s * 0.1, command.w_rad_s * 0.1, OdometryModel.EXACT_ARC)
    assert pose.x_m == pytest.approx(9.95 - 4.0, abs=0.2)


def test_the_guard_refuses_driving_into_the_map_but_not_away_from_it() -> None:
    robot = replace(told_of().robot, footprint=Footprint.disc(0.3))
    guard = ArcGuard(GuardConfig(horizon_s=0.5, margin_m=0.03), robot)
    wall = NearWalls(np.array([[1.0, -5.0, 1.0, 5.0]]))
    here = Pose2(0.6, 0.0, 0.0)
    assert not guard.allows(Twist(0.5, 0.0), here, wall, NO_CIRCLES, 1.0)
    assert guard.allows(Twist(0.0, 1.0), here, wall, NO_CIRCLES, 1.0)
    assert guard.allows(Twist(-0.5, 0.0), Pose2(0.69, 0.0, 0.0), wall, NO_CIRCLES, 1.0)
    assert guard.allows(Twist(0.5, 0.0), Pose2(0.2, 0.0, 0.0), wall, NO_CIRCLES, 1.0)


def test_the_guard_swings_no_corner_into_the_map() -> None:
    """A rectangle that turned to look around met somebody who stood beside it and was on its map."""
    corners = np.array([[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]])
    robot = replace(told_of().robot, footprint=Footprint.polygon(corners))
    guard = ArcGuard(GuardConfig(), robot)
    far, here = NearWalls(np.array([[5.0, -5.0, 5.0, 5.0]])), Pose2(0.0, 0.0, 0.0)
    beside, ahead = np.array([[0.0, 0.26, 0.03]]), np.array([[0.2, 0.26, 0.03]])
    assert not guard.allows(Twist(0.0, 1.0), here, far, beside, 1.0)
    assert not guard.allows(Twist(0.0, -1.0), here, far, beside, 1.0)
    assert not guard.allows(Twist(0.0, 1.0), here, far, ahead, 1.0)
    assert guard.allows(Twist(0.0, -1.0), here, far, ahead, 1.0)
    assert guard.allows(Twist(0.0, 1.0), here, far, NO_CIRCLES, 1.0)
    assert not guard.allows(Twist(0.0, 1.0), Pose2(4.74, 0.0, 0.0), far, NO_CIRCLES, 1.0)
    back = Twist(-0.3, 0.0)
    assert not guard.corners_may(back, here, far, np.array([[-0.3, 0.0, 0.03]]))
    assert guard.corners_may(back, here, far, np.array([[0.3, 0.0, 0.03]]))


def test_the_guard_knows_how_sharply_a_car_turns() -> None:
    """A car that was told to turn away from a pillar in half of its least radius drove into it."""
    robot = replace(told_of().robot, footprint=Footprint.disc(0.3), motion=BicycleConfig())
    guards = [ArcGuard(GuardConfig(horizon_s=1.0), one) for one in (robot, told_of().robot)]
    wall = NearWalls(np.array([[0.9, -5.0, 0.9, 5.0]]))
    sharply = Twist(0.5, 3.0)
    assert robot.motion.least_turning_radius_m > 0.7
    assert [guard.allows(sharply, Pose2(0.4, 0.0, 0.0), wall, NO_CIRCLES, 1.0) for guard in guards] == [
        False,
        True,
    ]
