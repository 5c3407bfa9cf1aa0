"""The navigator that drives by the laser: what it hands to its controller, and whom it refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Reading, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.local.drive import in_sight, limits_of, polygon_around
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.navigator.local import LocalConfig, LocalNavigator
from pilotage.stack.navigator.navigator import Parts
from support.robots import Told, told_of

START = Pose2(2.0, 2.0, 0.5)
RANGES = np.full(539, 3.0)


class Noting:
    """Notes what it sees."""

    def __init__(self) -> None:
        self.views: list[LocalView] = []
        self.status = "driving"

    def step(self, view: LocalView) -> Twist:
        self.views.append(view)
        return Twist(0.1 * len(self.views), 0.0)


class Jumping:
    """A localizer that finds itself half a metre to the left at the second step."""

    def __init__(self) -> None:
        self.steps = 0

    @property
    def belief(self) -> Belief:
        return Belief(Pose2(2.0, 2.5 if self.steps > 1 else 2.0, 0.5), np.eye(3))

    def step(self, readings: Readings) -> Belief:
        del readings
        self.steps += 1
        return self.belief


class Lost(Jumping):
    """One that has given up its belief at the second and third step: it is in the middle of the map then."""

    @property
    def belief(self) -> Belief:
        if self.steps in (2, 3):
            return Belief.anywhere((0.0, 0.0, 16.0, 12.0))
        return Belief(START, np.eye(3) * 1e-4)


def navigator(noting: Noting, told: Told, localizer: Jumping | None = None) -> LocalNavigator:
    parts = Parts(localizer, None, None, None, None, None, None, None, noting)
    return told.navigator(LocalNavigator, LocalConfig(), parts)


def readings(t_s: float, distance_m: float, angle_rad: float, scan: bool = True) -> Readings:
    said: dict[str, Reading] = {"odometry": OdometryIncrement(distance_m, angle_rad)}
    return Readings(t_s, {**said, "lidar": LidarScan(RANGES)} if scan else said)


def test_it_integrates_odometry_and_keeps_its_command_between_scans() -> None:
    noting, told = Noting(), told_of(start=START, variances=(0.0, 0.0, 0.0))
    stack = navigator(noting, told)
    assert stack.step(readings(0.1, 0.0, 0.0, scan=False)) == Twist(0.0, 0.0)
    assert stack.step(readings(0.2, 0.1, 0.0)) == Twist(0.1, 0.0)
    assert stack.step(readings(0.3, 0.1, 0.0, scan=False)) == Twist(0.1, 0.0)
    assert stack.step(readings(0.4, 0.0, 0.2)) == Twist(0.2, 0.0)
    first, second = noting.views
    assert first.twist.v_m_s == pytest.approx(1.0)
    assert second.twist.w_rad_s == pytest.approx(2.0)
    assert (first.t_s, second.t_s) == (0.2, 0.4)
    assert second.pose.x_m == pytest.approx(2.0 + 0.2 * math.cos(0.5))
    assert second.pose.theta_rad == pytest.approx(0.7)
    assert second.goal_xy_m == (8.0, 6.0)
    assert first.footprint_xy_m is second.footprint_xy_m
    assert stack.belief.pose.x_m == pytest.approx(second.pose.x_m)
    assert told.said["distance_to_go_m"] == pytest.approx(
        math.hypot(8.0 - second.pose.x_m, 6.0 - second.pose.y_m)
    )


def test_a_localizers_jump_moves_the_goal_not_the_pose() -> None:
    noting = Noting()
    stack = navigator(noting, told_of(start=START), Jumping())
    for step in range(1, 4):
        stack.step(readings(0.1 * step, 0.0, 0.0))
    before, after, then = noting.views
    assert before.pose == after.pose
    assert before.goal_xy_m == (8.0, 6.0)
    assert after.goal_xy_m == pytest.approx((8.0, 5.5))
    assert then.goal_xy_m == after.goal_xy_m


def lost_for_two_steps(mates: int) -> tuple[Noting, Told, list[Twist]]:
    """Driving, lost in two steps with a controller that calls itself there, and driving on."""
    noting, told = Noting(), told_of(start=START)
    told = replace(told, task=replace(told.task, mates=mates))
    stack = navigator(noting, told, Lost())
    commands = [stack.step(readings(0.1, 0.1, 0.0))]
    noting.status = "arrived"
    for step in (2, 3):
        commands.append(stack.step(readings(0.1 * step, 0.0, 0.0)))
        assert stack.status[0] is StackStatus.RUNNING
        assert math.isnan(told.said["distance_to_go_m"])
    noting.status = "driving"
    commands.append(stack.step(readings(0.4, 0.1, 0.0)))
    return noting, told, commands


def test_who_is_lost_wanders_and_is_not_at_a_goal_in_the_middle_of_the_map() -> None:
    """It drove on from there, and was at a goal that lies there."""
    noting, told, (driving, *lost, found) = lost_for_two_steps(0)
    assert (driving, found) == (Twist(0.1, 0.0), Twist(0.2, 0.0))
    assert all(command.v_m_s > 0.0 for command in lost)  # the lane ahead is open
    assert len(noting.views) == 2
    assert [event.kind for event in told.journal.events] == ["lost", "found"]


def test_who_is_lost_among_others_stands() -> None:
    _, _, (_, *lost, found) = lost_for_two_steps(1)
    assert lost == [STOP, STOP]
    assert found == Twist(0.2, 0.0)


def test_it_arrives_when_its_controller_says_so_and_stays() -> None:
    noting, told = Noting(), told_of(start=START)
    stack = navigator(noting, told)
    noting.status = "arrived"
    assert stack.step(readings(0.1, 0.0, 0.0)) == Twist(0.0, 0.0)
    assert stack.status == (StackStatus.ARRIVED, "within 0.15 m of the goal")
    assert stack.step(readings(0.2, 0.0, 0.0)) == Twist(0.0, 0.0)
    assert len(noting.views) == 1
    assert [event.kind for event in told.journal.events] == ["arrived"]


def test_who_went_astray_by_its_scans_is_shown_the_goal_anew() -> None:
    """A controller slid along a bare aisle by its scans and said that it was there, 0.7 m away."""
    noting = Noting()
    stack = navigator(noting, told_of(start=START), Jumping())
    noting.status = "arrived"
    for step in range(1, 4):
        stack.step(readings(0.1 * step, 0.0, 0.0))
    assert stack.status[0] is StackStatus.RUNNING
    assert [view.goal_is_sure for view in noting.views] == [False, True, True]


def test_limits_are_those_of_the_data_sheet() -> None:
    robot = replace(
        told_of().robot,
        motion=DifferentialDriveConfig(
            max_speed_m_s=1.5,
            max_turn_rate_rad_s=3.0,
            max_acceleration_m_s2=1.2,
            max_turn_acceleration_rad_s2=5.0,
            delay_s=0.1,
        ),
    )
    limits = limits_of(robot, 4.0, "the test")
    assert (limits.speed_m_s, limits.reverse_m_s, limits.delay_s) == (1.5, 1.5, 0.1)
    assert (limits.acceleration_m_s2, limits.deceleration_m_s2) == (1.2, 1.2)
    assert (limits.turn_rate_rad_s, limits.turn_acceleration_rad_s2) == (3.0, 5.0)


def test_it_is_no_faster_than_it_can_stop_where_it_sees() -> None:
    """At 1 m/s with a laser of half a metre, or of three beams, it ran into walls."""
    robot = replace(told_of().robot, footprint=Footprint.disc(0.3))
    limits = limits_of(robot, 0.5, "the test")
    assert in_sight(limits, robot, LidarConfig(), "the test") == limits, "a laser that sees far"
    for lidar, shown_m in (
        (LidarConfig(max_range_m=0.5), 0.5),
        (LidarConfig(beams=3, field_of_view_rad=2.0), 0.6 / math.tan(1.0)),
    ):
        speed = in_sight(limits, robot, lidar, "the test").speed_m_s
        stops_m = speed * 0.1 + 0.5 * speed**2 / limits.deceleration_m_s2
        assert stops_m == pytest.approx(shown_m - 0.3)
    for blind in (LidarConfig(max_range_m=0.2), LidarConfig(beams=3), LidarConfig(beams=1)):
        with pytest.raises(InputError, match=r"the test: expected a laser that shows the ground before the"):
            in_sight(limits, robot, blind, "the test")


def test_the_outline_of_a_disc_holds_it() -> None:
    corners = polygon_around(Footprint.disc(0.3))
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    assert np.hypot(*middles.T) == pytest.approx(0.3)


def test_what_it_cannot_drive_is_refused() -> None:
    told = told_of(start=START)
    with pytest.raises(InputError, match=r"stack\.local_controller"):
        told.navigator(LocalNavigator, LocalConfig(), Parts(None, None, None, None, None, None, None, None))
    with pytest.raises(InputError, match=r"world\.goal"):
        navigator(Noting(), told_of(start=START, goal=None))
    steered = replace(told, robot=replace(told.robot, motion=BicycleConfig(wheelbase_m=0.5)))
    with pytest.raises(InputError, match="turns on the spot"):
        navigator(Noting(), steered)
    blind = replace(told, robot=replace(told.robot, sensors={}))
    with pytest.raises(InputError, match="expected one lidar"):
        navigator(Noting(), blind)


def test_a_sensor_that_is_missed_is_not_confused_with_what_another_is_called() -> None:
    told = told_of()
    named = {"odometry": WheelOdometryConfig(), "lidar": BeaconConfig(), "beacons": BeaconConfig()}
    robot = replace(told.robot, sensors=named)
    expected = r"expected one lidar among .* has: odometry \(wheel-odometry\), lidar \(beacons\), beacons$"
    with pytest.raises(InputError, match=expected):
        robot.one_sensor(LidarConfig, "who asks")
