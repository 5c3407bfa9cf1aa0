"""Sensors that are read more often than the odometry: what they say is about where the robot was then."""

from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.types import Pose2
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


def readings(t_s: float, increment: OdometryIncrement | None = None) -> Readings:
    said: dict[str, Reading] = {"laser": SCAN}
    return Readings(t_s, said if increment is None else said | {"wheels": increment})


def test_each_reading_gets_its_share_of_the_increment() -> None:
    noting = Noting()
    localizer = BetweenIncrements(noting, "wheels", 0.2, 0.1)
    localizer.step(readings(0.1, OdometryIncrement(0.1, 0.0)))
    localizer.step(readings(0.2))
    assert [step.t_s for step in noting.told] == [0.1]
    localizer.step(readings(0.3, OdometryIncrement(0.2, 0.1, -0.04, 0.02)))
    assert [step.t_s for step in noting.told] == [0.1, 0.2, 0.3]
    share = OdometryIncrement(0.1, 0.05, -0.02, 0.01)
    assert [step.by_sensor["wheels"] for step in noting.told[1:]] == [share, share]
    assert all(step.by_sensor["laser"] is SCAN for step in noting.told)
    assert localizer.look_bearing_rad() == 0.25
    able = Abilities.of(localizer)
    assert able.look_bearing_rad() == 0.25, "what the localizer can do besides"
    assert able.scan_grid is None, "and nothing that it cannot"
    assert able.close_loops() == 0
    assert not hasattr(localizer, "told"), "its own affairs stay its own"


def test_where_an_increment_is_late_nothing_is_held() -> None:
    noting = Noting()
    localizer = BetweenIncrements(noting, "wheels", 0.2, 0.1)
    localizer.step(readings(0.1, OdometryIncrement(0.1, 0.0)))
    for t_s in (0.2, 0.3, 0.4):
        localizer.step(readings(t_s))
    assert [step.t_s for step in noting.told] == [0.1, 0.2, 0.3, 0.4]
    assert all("wheels" not in step.by_sensor for step in noting.told[1:])
    localizer.step(readings(0.5, OdometryIncrement(0.4, 0.0)))
    assert noting.told[-1].by_sensor["wheels"] == OdometryIncrement(0.4, 0.0)


def test_who_reads_no_oftener_is_told_as_before() -> None:
    told, noting = told_of(), Noting()
    robot = told.robot
    assert in_between(noting, robot) is noting
    robot.sensors["odometry"] = WheelOdometryConfig(rate_hz=5.0)  # type: ignore[index]
    assert in_between(noting, robot) is not noting
    reckoning = DeadReckoningLocalizer(DeadReckoningConfig(), robot, told.chart, told.initial, told.journal)
    assert in_between(reckoning, robot) is reckoning, "navigators look whether anything corrects it"


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
