"""Every registered motion drives and every registered sensor reads in the one simulator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import Pose2, Twist
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MOTIONS, MotionConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from support.worlds import CAR, DISC, ROOM_MAP, robot, simulator

MOTION_EXAMPLES: dict[str, dict[str, Any]] = {
    "differential-drive": {},
    "omnidirectional": {},
    "bicycle": {"wheelbase_m": 0.5},
    "wheel-drive": {"max_wheel_speed_rad_s": 20.0},
}
SENSOR_EXAMPLES: dict[str, dict[str, Any]] = {
    "wheel-odometry": {},
    "lidar": {"beams": 61},
    "beacons": {},
    "ultrasonic": {"range_var_m2": 1e-4},
    "infrared": {},
    "line-sensor": {},
    "magnetometer": {},
    "gyroscope": {"rate_hz": 100.0},
    "wheel-encoders": {"rate_hz": 100.0},
    "imu": {},
    "compass": {},
    "gps": {"dropout_share": 0.2},
    "bumper": {},
    "radio": {"loss": 0.2},
}


def motion(name: str) -> MotionConfig:
    config = MOTIONS.configure(name, MOTION_EXAMPLES[name], "robot.motion")
    assert isinstance(config, MotionConfig)
    return config


def sensor(name: str) -> SensorConfig:
    config = SENSORS.configure(name, SENSOR_EXAMPLES[name], "robot.sensors.it")
    assert isinstance(config, SensorConfig)
    if "rate_hz" in SENSOR_EXAMPLES[name]:
        return config
    return config.model_copy(update={"rate_hz": 10.0})


def test_everything_registered_has_an_example() -> None:
    assert set(MOTION_EXAMPLES) == set(MOTIONS.names())
    assert set(SENSOR_EXAMPLES) == set(SENSORS.names())


@pytest.mark.parametrize("footprint", [DISC, CAR], ids=["disc", "car"])
@pytest.mark.parametrize("name", sorted(MOTION_EXAMPLES))
class TestMotion:
    """What every motion promises."""

    def test_follows_a_twist_within_its_limits(self, name: str, footprint: Footprint) -> None:
        config = motion(name)
        sim = simulator(robot(motion=config, footprint=footprint))
        body = sim.bodies[0]
        wanted = Twist(0.3, 0.1)
        for _ in range(25):
            sim.step([wanted])
        assert body.twist.v_m_s == pytest.approx(0.3, rel=0.05)
        assert body.twist.w_rad_s == pytest.approx(0.1, rel=0.1)
        for _ in range(25):
            sim.step([Twist(100.0, 100.0)])
            assert abs(body.twist.v_m_s) <= config.top_speed_m_s * 1.01
            assert abs(body.twist.w_rad_s) <= max(config.top_turn_rate_rad_s, 2.0) * 1.05

    def test_never_leaves_the_room_and_says_how_often_it_tried(self, name: str, footprint: Footprint) -> None:
        sim = simulator(robot(motion=motion(name), footprint=footprint))
        body = sim.bodies[0]
        rng = np.random.default_rng(1)
        for k in range(600):
            if k % 20 == 0:
                command = Twist(float(rng.uniform(-0.5, 1.0)), float(rng.uniform(-0.5, 0.5)))
            sim.step([command])
            assert body.clearance_m > -1e-6
            exact = sim.world.clearance_m(footprint, body.pose.as_array()[None, :])[0]
            assert body.clearance_m == pytest.approx(exact, abs=1e-12)
        assert body.collisions > 0
        assert body.driven_m > 1.0

    def test_the_same_seed_gives_the_same_drive(self, name: str, footprint: Footprint) -> None:
        def drive() -> Pose2:
            sim = simulator(robot(motion=motion(name), footprint=footprint, seed=4))
            for _ in range(50):
                sim.step([Twist(0.4, 0.3)])
            return sim.bodies[0].pose

        assert drive() == drive()


@pytest.mark.parametrize("name", sorted(SENSOR_EXAMPLES))
@pytest.mark.parametrize("drive", sorted(MOTION_EXAMPLES))
def test_every_sensor_reads_on_every_motion(name: str, drive: str) -> None:
    """Encoders excepted, which need wheels; the same seed gives the same readings, and some."""
    if name == "wheel-encoders" and drive != "wheel-drive":
        with pytest.raises(Exception, match="wheel-encoders need a motion whose wheels are known"):
            simulator(robot({"it": sensor(name)}, motion(drive)))
        return
    series = []
    for _attempt in range(2):
        sim = simulator(robot({"it": sensor(name)}, motion(drive), seed=1))
        heard = [sim.step([Twist(0.2, 0.4)])[0].by_sensor.get("it") for _ in range(40)]
        series.append([repr(reading) for reading in heard])
    assert series[0] == series[1]
    assert len(set(series[0]) - {"None"}) >= 1


@pytest.mark.parametrize("name", sorted(set(SENSOR_EXAMPLES) - {"bumper"}))
def test_equal_sensors_of_many_robots_say_what_each_would_say_alone(name: str) -> None:
    """Far from each other and out of sight; whether readings are taken together must not show."""
    starts = [Pose2(2.0, 2.0, 0.0), Pose2(2.0, 2.0, 0.5)]
    specs = [
        robot({"it": sensor(name)}, WheelDriveConfig(), start=start, seed=row, name=str(row))
        for row, start in enumerate(starts)
    ]
    # The second one is in a room of its own, thirty metres away in the same world.
    away = 30.0
    walls = ROOM_MAP.walls.segments_m
    moved = specs[1].__class__("1", DISC, specs[1].motion, specs[1].sensors, Pose2(2.0 + away, 2.0, 0.5),
                               specs[1].streams)  # fmt: skip
    world = World.of(ROOM_MAP, walls + np.array([away, 0.0, away, 0.0]))
    together = Simulator(world, [specs[0], moved], 0.1)
    alone = [Simulator(world, [specs[0]], 0.1), Simulator(world, [moved], 0.1)]
    for _ in range(20):
        commands = [Twist(0.05, 0.2), Twist(0.05, -0.2)]
        both = together.step(commands)
        each = [sim.step([command])[0] for sim, command in zip(alone, commands, strict=True)]
        for one, other in zip(both, each, strict=True):
            assert repr(one.by_sensor) == repr(other.by_sensor)


def test_a_wheel_drive_at_rest_reads_no_turn() -> None:
    sim = simulator(robot({"it": sensor("imu")}, WheelDriveConfig()))
    rates = [sim.step([Twist(0.0, 0.0)])[0].by_sensor["it"].rate_rad_s for _ in range(50)]  # type: ignore[union-attr]
    assert abs(float(np.mean(rates))) < math.radians(1.0)
