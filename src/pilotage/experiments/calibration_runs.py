"""The calibration runs in simulation: four drives for the odometry, the 8 m room for the range sensors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pilotage.calibration.steady import SteadyReadings
from pilotage.core.errors import InputError
from pilotage.core.types import STOP
from pilotage.experiments.build.build import build
from pilotage.experiments.build.robots import sensors_of
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.missions.mission import Mission
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import BeaconReadings, LidarScan, Reading, UltrasonicReading
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

ODOMETRY_RUNS = ("calibrate-x", "calibrate-y", "calibrate-xy", "calibrate-theta")
ROOM = "calibrate-room"
READINGS = 1000
WALL_AHEAD_M = 8.0
ULTRASONIC_DISTANCE_M = 2.0


def drive_odometry_runs(
    overrides: Sequence[str], seed: int, out: Path
) -> tuple[list[Path], WheelOdometryConfig]:
    """Drive the four runs; return their folders and the odometry that the robot was given.

    Every run has a seed of its own: with a common one the noise of all four would be the same draws.
    """
    missions = [
        load_mission(name, overrides, len(ODOMETRY_RUNS) * seed + i) for i, name in enumerate(ODOMETRY_RUNS)
    ]
    wheels = [c for c in sensors_of(missions[0].robot).values() if isinstance(c, WheelOdometryConfig)]
    if len(wheels) != 1:
        raise InputError(f"calibrate odometry: expected one wheel-odometry on the robot, found {len(wheels)}")
    folders = []
    for mission in missions:
        result = run_mission(mission, out=out)
        assert result.run_dir is not None
        folders.append(result.run_dir)
    return folders, wheels[0]


def listen_in_the_room(overrides: Sequence[str], seed: int) -> list[SteadyReadings]:
    """Take 1000 readings of every range sensor of the robot, as the report did (section 2.2.1).

    LiDAR and beacons from the middle of the room, an ultrasonic with the robot 2 m from the wall and turned
    so that the sensor faces it. What a perfect sensor would read comes from the same place without noise.
    """
    mission = load_mission(ROOM, overrides, seed)
    out: list[SteadyReadings] = []
    for name, config in sensors_of(mission.robot).items():
        place: list[str] = []
        if isinstance(config, UltrasonicConfig):
            theta = -config.mount.theta_rad
            place = [
                f"world.start.x_m={WALL_AHEAD_M - ULTRASONIC_DISTANCE_M}",
                f"world.start.theta_rad={theta}",
            ]
        elif not isinstance(config, LidarConfig | BeaconConfig):
            continue
        here = [*overrides, *place]
        noisy = _listen(load_mission(ROOM, here, seed), name, READINGS)
        exact = _listen(load_mission(ROOM, [*here, *_silence(name, config)], seed), name, 1)
        out += _series(name, config, noisy, exact[0])
    if not out:
        raise InputError(
            "calibrate range: expected a lidar, beacons or an ultrasonic on the robot, found none"
        )
    return out


def _silence(name: str, config: SensorConfig) -> list[str]:
    """Overrides that take a sensor's noise away."""
    variances = [field for field in type(config).model_fields if "_var_" in field]
    return [f"robot.sensors.{name}.{field}=0" for field in variances]


def _listen(mission: Mission, sensor: str, count: int) -> list[Reading]:
    """Stand still and take so many readings of one sensor."""
    simulator = build(mission).simulator
    readings: list[Reading] = []
    while len(readings) < count:
        reading = simulator.step([STOP])[0].by_sensor.get(sensor)
        if reading is not None:
            readings.append(reading)
    return readings


def _series(
    name: str, config: SensorConfig, noisy: Sequence[Reading], exact: Reading
) -> list[SteadyReadings]:
    """The quantities of one sensor."""
    if isinstance(config, LidarConfig) and isinstance(exact, LidarScan):
        beam = int(np.argmin(np.abs(config.beam_angles_rad() + config.mount.theta_rad)))
        ranges = np.array([r.ranges_m[beam] for r in noisy if isinstance(r, LidarScan)])
        title = f"range of beam {beam + 1}"
        return [SteadyReadings(name, title, "m", ranges, float(exact.ranges_m[beam]), config.range_var_m2)]
    if isinstance(config, BeaconConfig) and isinstance(exact, BeaconReadings):
        seen = [r for r in noisy if isinstance(r, BeaconReadings) and r.ids.size]
        if not exact.ids.size or not seen:
            raise InputError(f"calibrate range: expected '{name}' to see the beacon ahead, it sees none")
        ranges = np.array([r.ranges_m[0] for r in seen])
        bearings = np.array([r.bearings_rad[0] for r in seen])
        far, aside = float(exact.ranges_m[0]), float(exact.bearings_rad[0])
        return [
            SteadyReadings(name, "range", "m", ranges, far, config.range_var_m2),
            SteadyReadings(name, "bearing", "rad", bearings, aside, config.bearing_var_rad2),
        ]
    assert isinstance(config, UltrasonicConfig)
    assert isinstance(exact, UltrasonicReading)
    ranges = np.array([r.range_m for r in noisy if isinstance(r, UltrasonicReading)])
    return [SteadyReadings(name, "range", "m", ranges, exact.range_m, config.range_var_m2)]
