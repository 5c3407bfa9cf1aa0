"""Who asks for what leads too near to something, again and again, is taken a step clear of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.types import STOP, Pose2, Twist
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.step_clear import PATIENCE_S, StepClear
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.wandering import Wandering
from support.robots import told_of

DT_S = 0.1
ALL_ROUND = LidarConfig(beams=720, field_of_view_rad=2.0 * math.pi, rate_hz=10.0, range_var_m2=0.0)
IN_FRONT = ALL_ROUND.model_copy(update={"field_of_view_rad": math.pi})
BOX = np.array([[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]])
POST = [[0.06, 0.215, 0.10, 0.215]]
ROOM = [[-1.0, -1.0, 1.0, -1.0], [1.0, -1.0, 1.0, 1.0], [1.0, 1.0, -1.0, 1.0], [-1.0, 1.0, -1.0, -1.0]]


class Stub:
    """A localizer that believes what it was told."""

    def __init__(self, belief: Belief) -> None:
        self.belief = belief

    def step(self, readings: Readings) -> Belief:  # noqa: ARG002
        return self.belief


class Driver:
    """A robot that does at once what leaves, among walls, seen by one laser."""

    def __init__(self, sheet: LidarConfig, walls_m: list[list[float]], footprint: Footprint) -> None:
        sensors = {"lidar": sheet, "odometry": WheelOdometryConfig(rate_hz=10.0)}
        self.robot = robot = replace(told_of().robot, sensors=sensors, footprint=footprint)
        self.word, self._sheet, self._walls_m = LastWord(robot), sheet, np.array(walls_m)
        self.step_clear, self.pose, self._t_s = StepClear(robot, self.word), Pose2(0.0, 0.0, 0.0), 0.0
        self._moved = OdometryIncrement(0.0, 0.0)

    def scan_m(self) -> np.ndarray:
        first_rad = self.pose.theta_rad + float(self._sheet.beam_angles_rad()[0])
        ends = self._sheet.beam_step_rad, self._sheet.beams, self._sheet.max_range_m
        no_discs = np.zeros((0, 3))
        return fan_ranges(self.pose.x_m, self.pose.y_m, first_rad, *ends, self._walls_m, no_discs)

    def step(self, command: Twist) -> Twist:
        """Ask for a command, and drive what leaves."""
        return self.steps(lambda readings: self.step_clear.instead_of(command, readings.t_s))

    def steps(self, decides: Callable[[Readings], Twist]) -> Twist:
        """Sense, decide, and drive what leaves."""
        self._t_s += DT_S
        readings = Readings(self._t_s, {"lidar": LidarScan(self.scan_m()), "odometry": self._moved})
        self.word.take_in(readings)
        left = self.word.leaving(decides(readings))
        pose = self.pose
        v, w = left.v_m_s * DT_S, left.w_rad_s * DT_S
        self.pose = Pose2(*exact_arc(pose.x_m, pose.y_m, pose.theta_rad, v, w))
        self._moved = OdometryIncrement(v, w)
        return left


def test_who_asks_for_the_same_in_vain_is_taken_clear_of_what_stops_it() -> None:
    """An explorer stood beside a door post for as long as it was left there."""
    driver = Driver(ALL_ROUND, [*POST, *ROOM], Footprint.disc(0.2))
    asked = Twist(0.5, 1.0)
    left = [driver.step(asked) for _ in range(round(PATIENCE_S / DT_S))]
    assert left == [STOP] * len(left), "what walks goes by itself"
    nearest_m = driver.scan_m().min()
    for _ in range(12):
        driver.step(asked)
        assert driver.scan_m().min() > 0.2
    assert driver.scan_m().min() > nearest_m + 0.03


def test_who_rolls_goes_on_no_faster_where_it_may_not_as_fast_as_asked() -> None:
    """With weak brakes who was refused more speed, or a turn, braked instead, again and again."""
    motion = DifferentialDriveConfig(max_speed_m_s=1.0, max_acceleration_m_s2=0.4)
    sensors = {"lidar": ALL_ROUND, "odometry": WheelOdometryConfig(rate_hz=10.0)}
    told = replace(told_of().robot, motion=motion, sensors=sensors, dt_s=DT_S, footprint=Footprint.disc(0.3))
    word = LastWord(told)
    step_clear = StepClear(told, word)

    def left(t_s: float, command: Twist, ahead_m: float) -> Twist:
        wall, ends = [[ahead_m, -9.0, ahead_m, 9.0]], (ALL_ROUND.beam_step_rad, 720, 20.0)
        scan = fan_ranges(0.0, 0.0, -math.pi, *ends, np.array(wall), np.zeros((0, 3)))
        moved = OdometryIncrement(0.07 if t_s > 0.1 else 0.0, 0.0)
        word.take_in(Readings(t_s, {"lidar": LidarScan(scan), "odometry": moved}))
        return word.leaving(step_clear.instead_of(command, t_s))

    for step in range(1, 40):
        assert left(0.1 * step, Twist(0.7, 0.0), 1.06 + 0.07 * (40 - step)) == Twist(0.7, 0.0)
    assert left(4.0, Twist(1.0, 0.0), 1.06) == Twist(0.7, 0.0)
    braked = left(4.1, Twist(1.0, 0.0), 0.9)
    assert braked.v_m_s == pytest.approx(0.66)


def test_what_is_allowed_leaves_as_it_is() -> None:
    driver = Driver(ALL_ROUND, [*POST, *ROOM], Footprint.disc(0.2))
    for _ in range(50):
        assert driver.step(Twist(0.0, 0.3)) == Twist(0.0, 0.3)


def test_what_does_not_stay_in_the_way_is_waited_for() -> None:
    driver = Driver(ALL_ROUND, [*POST, *ROOM], Footprint.disc(0.2))
    for _ in range(30):
        left = [driver.step(Twist(0.5, 1.0)) for _ in range(10)]
        assert left == [STOP] * 10
        for _ in range(12):
            driver.step(STOP)


def test_who_sees_nothing_behind_it_does_not_back() -> None:
    walls = [[0.25, -1.0, 0.25, 1.0], *ROOM]
    driver = Driver(IN_FRONT, walls, Footprint.disc(0.2))
    for _ in range(60):
        assert driver.step(Twist(0.5, 0.0)).v_m_s >= 0.0
    assert driver.pose.x_m < 0.05


@pytest.mark.parametrize("others", [True, False])
def test_a_step_leaves_room_for_whatever_else_there_is(others: bool) -> None:
    driver = Driver(ALL_ROUND, [*POST, *ROOM], Footprint.disc(0.2))
    step_clear = driver.step_clear
    asked = Twist(0.5, 1.0)
    for _ in range(round(PATIENCE_S / DT_S) + 1):
        driver.step(STOP)
        driver.word.allows(asked)
    moved = [step_clear.instead_of(asked, 5.0 + DT_S * k, lambda _: others) for k in range(5)]
    assert (moved != [STOP] * 5) == others


def test_an_outline_is_taken_clear_with_its_corners() -> None:
    driver = Driver(ALL_ROUND, [[0.1, 0.215, 0.6, 0.215], *ROOM], Footprint.polygon(BOX))
    for _ in range(round(PATIENCE_S / DT_S) + 10):
        driver.step(Twist(0.3, 0.5))
        corners_m = driver.pose.placed(BOX)
        assert (corners_m[corners_m[:, 0] > 0.1, 1] < 0.21).all()
    assert driver.scan_m().min() > 0.24


def test_who_is_lost_where_its_corners_cannot_turn_steps_clear() -> None:
    """Between two walls, before a third: it stood there for as long as its sweep lasted."""
    walls = [[-1.0, 0.215, 0.3, 0.215], [-1.0, -0.215, 0.3, -0.215], [0.3, -0.215, 0.3, 0.215]]
    driver = Driver(ALL_ROUND, [*walls, [-3.0, -2.0, -3.0, 2.0]], Footprint.polygon(BOX))
    wandering = Wandering(WanderConfig(), driver.robot, Stub(told_of().initial), driver.word)
    for _ in range(300):
        driver.steps(wandering.step)
    assert driver.pose.x_m < -0.7
