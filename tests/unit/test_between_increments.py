"""Sensors that are read more often than the odometry: what they say is about where the robot was then."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Reading, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.localization.between_increments import BetweenIncrements, in_between
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Abilities
from support.robots import told_of


class Noting:
    """Notes what it is told."""

    def __init__(self) -> None:
        self.told: list[Readings] = []
        self.belief = Belief(Pose2(0.0, 0.0, 0.0), np.eye(3))

    def step(self, readings: Readings) -> Belief:
        self.told.append(readings)
        return self.belief

    def look_bearing_rad(self) -> float | None:
        return 0.25


SCAN = LidarScan(np.full(3, 2.0))
WHEELS = WheelOdometryConfig(rate_hz=5.0)


def readings(t_s: float, increment: OdometryIncrement | None = None) -> Readings:
    said: dict[str, Reading] = {"laser": SCAN}
    return Readings(t_s, said if increment is None else said | {"wheels": increment})


def between(noting: Noting) -> BetweenIncrements:
    """Of odometry at every second step of 0.1 s, on a robot that is told what it is commanded."""
    robot = replace(told_of().robot, sensors={"laser": LidarConfig(), "wheels": WHEELS}, dt_s=0.1)
    return BetweenIncrements(noting, "wheels", WHEELS, robot)


def test_each_reading_gets_its_share_of_the_increment() -> None:
    """Half of it where nothing was commanded; where the robot is turned first, that comes first."""
    noting = Noting()
    localizer = between(noting)
    localizer.step(readings(0.1, OdometryIncrement(0.1, 0.0)))
    localizer.step(readings(0.2))
    assert [step.t_s for step in noting.told] == [0.1]
    localizer.step(readings(0.3, OdometryIncrement(0.2, 0.1, -0.04, 0.02)))
    assert [step.t_s for step in noting.told] == [0.1, 0.2, 0.3]
    for step in noting.told[1:]:
        share = step.by_sensor["wheels"]
        assert isinstance(share, OdometryIncrement)
        assert replace(share, part_var=(0.0, 0.0, 0.0)) == OdometryIncrement(0.1, 0.05, -0.02, 0.01)
        assert min(share.part_var) > 0.0, "which half is uncertain"
    assert all(step.by_sensor["laser"] is SCAN for step in noting.told)
    localizer.commanded.sent(0.3, Twist(0.0, 0.5))
    localizer.step(readings(0.4))
    localizer.commanded.sent(0.4, Twist(0.2, 0.0))
    localizer.step(readings(0.5, OdometryIncrement(0.02, 0.05)))
    first, second = (step.by_sensor["wheels"] for step in noting.told[3:])
    assert isinstance(first, OdometryIncrement)
    assert isinstance(second, OdometryIncrement)
    assert (first.angle_rad, second.angle_rad) == pytest.approx((0.05, 0.0), abs=1e-9)
    assert (first.distance_m, second.distance_m) == pytest.approx((0.0, 0.02), abs=1e-9)


def test_it_can_what_the_localizer_can() -> None:
    localizer = between(Noting())
    assert localizer.look_bearing_rad() == 0.25
    able = Abilities.of(localizer)
    assert able.look_bearing_rad() == 0.25, "what the localizer can do besides"
    assert able.scan_grid is None, "and nothing that it cannot"
    assert able.close_loops() == 0
    assert able.corrects
    assert not hasattr(localizer, "told"), "its own affairs stay its own"


def test_the_belief_goes_on_as_commanded_and_is_less_sure() -> None:
    noting = Noting()
    localizer = between(noting)
    localizer.step(readings(0.1, OdometryIncrement(0.0, 0.0)))
    assert localizer.belief is noting.belief
    localizer.commanded.sent(0.1, Twist(0.2, 0.0))
    ahead = localizer.step(readings(0.2))
    assert ahead is localizer.belief
    assert (ahead.pose.x_m, ahead.pose.y_m) == pytest.approx((0.02, 0.0))
    assert ahead.cov[0, 0] > 1.0
    assert ahead.cov[2, 2] > 1.0
    localizer.step(readings(0.3, OdometryIncrement(0.0, 0.0)))
    assert localizer.belief is noting.belief, "what was foretold is forgotten when the increment comes"


def test_where_an_increment_is_late_nothing_is_held() -> None:
    noting = Noting()
    localizer = between(noting)
    localizer.step(readings(0.1, OdometryIncrement(0.1, 0.0)))
    for t_s in (0.2, 0.3, 0.4):
        localizer.step(readings(t_s))
    assert [step.t_s for step in noting.told] == [0.1, 0.2, 0.3, 0.4]
    assert all("wheels" not in step.by_sensor for step in noting.told[1:])
    assert localizer.belief is noting.belief, "which says how little it knows now"
    localizer.step(readings(0.5, OdometryIncrement(0.4, 0.0)))
    assert noting.told[-1].by_sensor["wheels"] == OdometryIncrement(0.4, 0.0)


def test_who_has_odometry_at_each_step_is_told_as_before() -> None:
    told, noting = told_of(), Noting()
    robot = told.robot
    assert in_between(noting, robot) is noting
    robot.sensors["odometry"] = WheelOdometryConfig(rate_hz=5.0)  # type: ignore[index]
    assert isinstance(in_between(noting, robot), BetweenIncrements)
    reckoning = DeadReckoningLocalizer(DeadReckoningConfig(), robot, told.chart, told.initial, told.journal)
    assert not Abilities.of(in_between(reckoning, robot)).corrects, "navigators ask whether anything does"


@pytest.mark.parametrize("localizer", ["ekf-landmarks", "ekf-walls", "particle-filter", "dead-reckoning"])
def test_a_belief_between_increments_is_as_right_as_it_says(localizer: str) -> None:
    """It waited where the last increment had left it: off by 0.4 m, and by up to 2300 times its variance.

    The squared error in standard deviations, of position, is 2 on average; here the mean over 20 s may be 4
    and single values beyond the 0.9999 quantile may be 1 in 100.
    """
    sensors: dict[str, Any] = {
        "odometry": {"name": "wheel-odometry", "rate_hz": 2},
        "lidar": {"name": "lidar", "beams": 180},
        "beacons": {"name": "beacons"},
    }
    speed, turn = [0.8, 0.3, 0.8, 0.0], [0.4, -0.8, 0.0, 1.0]
    program = [
        {"speed_m_s": v, "turn_rate_rad_s": w, "duration_s": 1.3} for v, w in zip(speed, turn, strict=True)
    ]
    mission = {
        "mission": "slow-odometry",
        "world": {"map": "museum", "start": {"x_m": 20.0, "y_m": 18.0}},
        "robot": {"sensors": sensors},
        "task": {"name": "localize", "tolerance_m": 0.45},
        "stack": {"navigator": {"name": "open-loop", "program": 4 * program}, "localizer": localizer},
        "run": {"dt_s": 0.05},
    }
    trace = pl.run(mission, save=False, progress=False).trace
    dx, dy = trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"]
    xx, xy, yy = trace["cov_xx_m2"], trace["cov_xy_m2"], trace["cov_yy_m2"]
    squared = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    assert float(np.mean(squared)) < 4.0
    assert float(np.mean(squared > 18.4)) < 0.01


@pytest.mark.parametrize(
    ("localizer", "odometry_hz"), [("ekf-landmarks", 5), ("ekf-walls", 5), ("particle-filter", 2.5)]
)
def test_a_robot_of_slow_odometry_stays_localized(localizer: str, odometry_hz: float) -> None:
    """What it saw was taken for seen from where it had been, up to 0.4 m behind: it was lost at once."""
    sensors: dict[str, Any] = {
        "odometry": {"name": "wheel-odometry", "rate_hz": odometry_hz},
        "lidar": {"name": "lidar", "beams": 180},
        "beacons": {"name": "beacons"},
    }
    mission = {
        "mission": "slow-odometry",
        "world": {"map": "museum", "start": {"x_m": 20.0, "y_m": 18.0}},
        "robot": {"sensors": sensors},
        "task": {"name": "localize", "tolerance_m": 0.45},
        "stack": {
            "navigator": {"name": "open-loop", "speed_m_s": 0.8, "turn_rate_rad_s": 0.5, "duration_s": 20.0},
            "localizer": localizer,
        },
    }
    run = pl.run(mission, save=False, progress=False)
    assert run.success, run.reason
    assert float(np.mean(run.trace["localized"])) == 1.0
