"""What each sensor would read in the true world; every sensor has its own noise stream."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.scans import rays
from pilotage.models.odometry import increment_variances
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import (
    BeaconReadings,
    LidarScan,
    OdometryIncrement,
    Reading,
    UltrasonicReading,
)
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.world import World


@dataclass(frozen=True, slots=True)
class Motion:
    """What the body did in one step: its pose afterwards, the distance along the arc, the angle turned."""

    pose: Pose2
    distance_m: float
    angle_rad: float


class SimulatedSensor(Protocol):
    """One sensor in the simulated world."""

    def observe(self, motion: Motion) -> None:
        """Take note of one step; called at every step."""
        ...

    def read(self, motion: Motion) -> Reading:
        """Give a reading; called when the sensor's period is over."""
        ...


def _mounted(pose: Pose2, mount: Mount) -> tuple[float, float, float]:
    """Pose of a mounted sensor in the map frame (its heading not wrapped)."""
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    return (
        pose.x_m + c * mount.x_m - s * mount.y_m,
        pose.y_m + s * mount.x_m + c * mount.y_m,
        pose.theta_rad + mount.theta_rad,
    )


class SimulatedWheelOdometry:
    """Sums the motion since the last reading and adds noise that grows with it."""

    def __init__(self, config: WheelOdometryConfig, _world: World, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        self._drift = config.angle_bias_rad_s / config.rate_hz
        self._distance = self._angle = 0.0
        self._distance_var = self._angle_var = 0.0

    def observe(self, motion: Motion) -> None:
        """Add one step; its variance grows with its own way, also where steps cancel."""
        c = self._config
        self._distance += motion.distance_m
        self._angle += motion.angle_rad
        distance_var, angle_var = increment_variances(
            motion.distance_m,
            motion.angle_rad,
            c.distance_var_m2_per_m,
            c.distance_var_m2_per_rad,
            c.angle_var_rad2_per_rad,
            c.angle_var_rad2_per_m,
        )
        self._distance_var += distance_var
        self._angle_var += angle_var

    def read(self, motion: Motion) -> Reading:
        """Give the noisy sum and start anew."""
        del motion
        noise = self._rng.standard_normal(2)
        reading = OdometryIncrement(
            self._config.distance_scale * self._distance + math.sqrt(self._distance_var) * float(noise[0]),
            self._config.angle_scale * self._angle
            + self._drift
            + math.sqrt(self._angle_var) * float(noise[1]),
        )
        self._distance = self._angle = self._distance_var = self._angle_var = 0.0
        return reading


class SimulatedLidar:
    """Exact ray casting plus Gaussian range noise."""

    def __init__(self, config: LidarConfig, world: World, rng: np.random.Generator) -> None:
        self._config = config
        self._step = config.beam_step_rad
        self._first = float(config.beam_angles_rad()[0])
        from_first = config.beam_angles_rad() - self._first
        self._cosines, self._sines = np.cos(from_first), np.sin(from_first)
        self._std = math.sqrt(config.range_var_m2)
        self._segments, self._circles = world.geometry.segments_m, world.geometry.circles_m
        self._rng = rng

    def observe(self, motion: Motion) -> None:
        """Nothing to remember between readings."""

    def read(self, motion: Motion) -> Reading:
        """Scan from where the sensor is now."""
        c = self._config
        x, y, theta = _mounted(motion.pose, c.mount)
        exact = rays.table_fan_ranges(
            x,
            y,
            theta + self._first,
            self._step,
            self._cosines,
            self._sines,
            c.max_range_m,
            self._segments,
            self._circles,
        )
        normals = self._rng.standard_normal(c.beams)
        return LidarScan(rays.add_range_noise(exact, normals, self._std, c.max_range_m))


class SimulatedBeacons:
    """Range, bearing and identity of the landmarks in sight."""

    def __init__(self, config: BeaconConfig, world: World, rng: np.random.Generator) -> None:
        self._config = config
        self._ids = world.landmarks.ids
        self._points = world.landmarks.points_xy_m
        self._segments, self._circles = world.geometry.segments_m, world.geometry.circles_m
        self._stds = np.array([[math.sqrt(config.range_var_m2)], [math.sqrt(config.bearing_var_rad2)]])
        self._ranges, self._bearings = np.empty(len(self._ids)), np.empty(len(self._ids))
        self._index = np.empty(len(self._ids), dtype=np.int64)
        self._rng = rng

    def observe(self, motion: Motion) -> None:
        """Nothing to remember between readings."""

    def read(self, motion: Motion) -> Reading:
        """Measure every landmark in sight; draws do not depend on which are."""
        c = self._config
        x, y, theta = _mounted(motion.pose, c.mount)
        count = rays.visible_points(
            x,
            y,
            theta,
            0.5 * c.field_of_view_rad,
            c.max_range_m,
            self._points,
            self._segments,
            self._circles,
            self._ranges,
            self._bearings,
            self._index,
        )
        noise = self._stds * self._rng.standard_normal((2, len(self._ids)))
        index = self._index[:count]
        ranges = self._ranges[:count] + noise[0, index]
        bearings = self._bearings[:count] + c.bearing_offset_rad + noise[1, index]
        return BeaconReadings(self._ids[index], np.abs(ranges), _wrap_small(bearings))


def _wrap_small(bearings_rad: FloatArray) -> FloatArray:
    """Wrap bearings that left [-pi, pi) by noise alone."""
    bearings_rad[bearings_rad >= math.pi] -= 2.0 * math.pi
    bearings_rad[bearings_rad < -math.pi] += 2.0 * math.pi
    return bearings_rad


class SimulatedUltrasonic:
    """The nearest return in the cone."""

    def __init__(self, config: UltrasonicConfig, world: World, rng: np.random.Generator) -> None:
        self._config = config
        self._std = math.sqrt(config.range_var_m2)
        self._segments, self._circles = world.geometry.segments_m, world.geometry.circles_m
        self._rng = rng

    def observe(self, motion: Motion) -> None:
        """Nothing to remember between readings."""

    def read(self, motion: Motion) -> Reading:
        """Measure; out of reach is flagged, below the least range reads as the least range."""
        c = self._config
        x, y, theta = _mounted(motion.pose, c.mount)
        distance = rays.cone_range(x, y, theta, 0.5 * c.cone_rad, self._segments, self._circles)
        if self._std > 0.0:
            distance += self._std * float(self._rng.standard_normal())
        if distance >= c.max_range_m:
            return UltrasonicReading(c.max_range_m, saturated=True)
        return UltrasonicReading(max(float(distance), c.min_range_m), saturated=False)


SIMULATED: dict[type[SensorConfig], Callable[..., SimulatedSensor]] = {
    WheelOdometryConfig: SimulatedWheelOdometry,
    LidarConfig: SimulatedLidar,
    BeaconConfig: SimulatedBeacons,
    UltrasonicConfig: SimulatedUltrasonic,
}
"""Which class simulates which sensor."""
