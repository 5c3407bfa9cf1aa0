"""Simulated sensors: noise as stated, own streams, own rates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import (
    BeaconReadings,
    LidarScan,
    OdometryIncrement,
    Readings,
    UltrasonicReading,
)
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from support.robots import sensors
from support.worlds import Alone, alone, robot

START = Pose2(2.0, 4.0, 0.0)
ALPHA = 1e-4
"""False-alarm rate of each statistical test here; the seeds are fixed, so a pass stays a pass."""


def simulator(configs: dict[str, SensorConfig], seed: int = 0, start: Pose2 = START) -> Alone:
    return alone(robot(configs, start=start, seed=seed))


def variance_interval(values: np.ndarray, alpha: float = ALPHA) -> tuple[float, float]:
    """Chi-square interval of a variance."""
    n = values.size
    total = float(((values - values.mean()) ** 2).sum())
    return total / stats.chi2.ppf(1 - alpha / 2, n - 1), total / stats.chi2.ppf(alpha / 2, n - 1)


def test_odometry_noise_grows_with_distance_and_angle() -> None:
    config = WheelOdometryConfig(
        distance_var_m2_per_m=1e-3, angle_var_rad2_per_rad=2e-4, angle_var_rad2_per_m=1e-5
    )
    sim = simulator({"odometry": config}, start=Pose2(2.5, 4.0, 0.0))
    distances, angles = [], []
    for k in range(3000):
        readings = sim.step(Twist(0.5, 1.0))
        reading = readings.by_sensor["odometry"]
        assert isinstance(reading, OdometryIncrement)
        if k >= 10:  # up to speed
            distances.append(reading.distance_m - 0.05)
            angles.append(reading.angle_rad - 0.1)
    low, high = variance_interval(np.array(distances))
    assert low < 1e-3 * 0.05 < high
    low, high = variance_interval(np.array(angles))
    assert low < 2e-4 * 0.1 + 1e-5 * 0.05 < high


def test_lidar_reads_the_room_with_its_noise() -> None:
    sim = simulator({"lidar": LidarConfig()})
    scans = []
    for _ in range(200):
        scan = sim.step(Twist(0.0, 0.0)).by_sensor["lidar"]
        assert isinstance(scan, LidarScan)
        scans.append(scan.ranges_m)
    table = np.array(scans)
    assert table.shape == (200, 539)
    middle = table[:, 269]  # straight ahead through the gap at x = 5 to the wall at x = 10
    assert middle.mean() == pytest.approx(8.0, abs=4 * math.sqrt(9.62015e-6 / 200))
    low, high = variance_interval((table - table.mean(axis=0)).ravel() * math.sqrt(200 / 199))
    assert low < 9.62015e-6 < high


def test_beacons_are_seen_with_their_ids_and_noise() -> None:
    sim = simulator({"beacons": sensors()["beacons"]}, start=Pose2(2.0, 4.0, 0.0))
    errors = []
    for _ in range(500):
        reading = sim.step(Twist(0.0, 0.0)).by_sensor["beacons"]
        assert isinstance(reading, BeaconReadings)
        # Beacon 4 lies behind the robot; 2 and 9 are seen through the gap or hidden by the inner walls.
        assert 4 not in reading.ids.tolist()
        where = reading.ids.tolist().index(7)
        errors.append(reading.ranges_m[where] - math.hypot(1.0, 3.95))
    low, high = variance_interval(np.array(errors))
    assert low < 3.4665e-4 < high


def test_saturated_ultrasonic_readings_are_flagged() -> None:
    sim = simulator({"front": UltrasonicConfig(), "back": UltrasonicConfig(mount={"theta_rad": math.pi})})
    by_sensor = sim.step(Twist(0.0, 0.0)).by_sensor
    front, back = by_sensor["front"], by_sensor["back"]
    assert isinstance(front, UltrasonicReading)
    assert isinstance(back, UltrasonicReading)
    assert front.saturated
    assert not back.saturated
    assert back.range_m == pytest.approx(2.0)


def run(configs: dict[str, SensorConfig]) -> list[Readings]:
    sim = simulator(configs)
    return [sim.step(Twist(0.3, 0.2)) for _ in range(20)]


def test_switching_one_sensor_off_leaves_what_the_others_say() -> None:
    everything, fewer = sensors(), sensors()
    del fewer["lidar"]
    for with_lidar, without in zip(run(everything), run(fewer), strict=True):
        assert with_lidar.by_sensor["odometry"] == without.by_sensor["odometry"]
        one, other = with_lidar.by_sensor["beacons"], without.by_sensor["beacons"]
        assert isinstance(one, BeaconReadings)
        assert isinstance(other, BeaconReadings)
        assert (one.ranges_m == other.ranges_m).all()


def test_same_seed_same_readings_other_seed_others() -> None:
    def first(seed: int) -> object:
        return simulator(sensors(), seed).step(Twist(0.3, 0.0)).by_sensor["odometry"]

    assert first(1) == first(1)
    assert first(1) != first(2)


def test_sensors_fire_at_their_own_rates() -> None:
    configs = {"odometry": WheelOdometryConfig(rate_hz=10), "lidar": LidarConfig(rate_hz=2.5)}
    fired = [set(readings.by_sensor) for readings in run(configs)]
    assert all("odometry" in names for names in fired)
    assert [k + 1 for k, names in enumerate(fired) if "lidar" in names] == [4, 8, 12, 16, 20]


def test_a_slow_odometry_adds_up_its_steps() -> None:
    exact = WheelOdometryConfig(
        rate_hz=2, distance_var_m2_per_m=0, angle_var_rad2_per_m=0, angle_var_rad2_per_rad=0
    )
    sim = simulator({"odometry": exact})
    total = 0.0
    for _ in range(50):
        reading = sim.step(Twist(0.3, 0.1)).by_sensor.get("odometry")
        if isinstance(reading, OdometryIncrement):
            total += reading.distance_m
    assert total == pytest.approx(0.3 * 4.9, abs=0.02)


def test_a_rate_that_does_not_divide_the_steps_is_refused() -> None:
    with pytest.raises(InputError, match="rate_hz"):
        simulator({"lidar": LidarConfig(rate_hz=3.0)})
