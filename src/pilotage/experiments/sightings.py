"""What the robot saw, kept small for a replay: scans thinned and quantised, the beacons by their ids."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.experiments.odometry_since import OdometrySince
from pilotage.records import scans as records
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import BeaconReadings, LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.perception.joint_scan import JointScan

APART_S = 0.2
"""Scans at least so far apart: at five a second the eye sees them move with the robot."""
MOST_BEAMS = 108
MOST_SCANS = 4000
"""Beyond that every other scan goes and the rest come half as often: the file does not grow with the run."""


class Sightings:
    """Collects the lidar's scans, of several the joint ones, with the odometry, and the ids that the first
    beacon sensor saw.
    """

    def __init__(self, sensors: dict[str, SensorConfig]) -> None:
        self._join = JointScan.of(sensors)
        name, sheet = _first(sensors, LidarConfig)
        self._lidar: str | None = name if self._join is None else self._join.name
        self._config: LidarConfig | None = sheet if self._join is None else self._join.sheet
        self._beacons, _ = _first(sensors, BeaconConfig)
        self._odometer: str | None = None if self._lidar is None else _first(sensors, WheelOdometryConfig)[0]
        self._driven, self._read_s = OdometrySince(), math.nan
        self._stride = 1 if self._config is None else max(1, math.ceil(self._config.beams / MOST_BEAMS))
        self._apart_s = APART_S
        self._scan_t_s: list[float] = []
        self._scans: list[FloatArray] = []
        self._poses: list[FloatArray] = []
        self._odometry: list[tuple[float, ...]] = []
        self._seen: list[IntArray] = []
        self._nothing: IntArray = np.empty(0, dtype=np.int64)

    def pass_over(self, readings: Readings) -> None:
        """Take note of the odometry of a step that is not kept."""
        if self._odometer is None:
            return
        reading = readings.by_sensor.get(self._odometer)
        if isinstance(reading, OdometryIncrement):
            self._driven.add(reading)
            self._read_s = readings.t_s
        elif math.isnan(self._read_s):
            self._read_s = readings.t_s  # it begins here

    def record(self, readings: Readings, pose: Pose2) -> None:
        """Keep what this step's readings show from where the robot is; called once a step."""
        self.pass_over(readings)
        seen = self._nothing
        if self._beacons is not None:
            reading = readings.by_sensor.get(self._beacons)
            if isinstance(reading, BeaconReadings):
                seen = reading.ids
        self._seen.append(seen)
        if self._lidar is None:
            return
        # A microsecond of slack: step times are sums of dt.
        if self._scan_t_s and readings.t_s - self._scan_t_s[-1] < self._apart_s - 1e-6:
            return
        scan = (readings if self._join is None else self._join.add(readings)).by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            self._scan_t_s.append(readings.t_s)
            self._scans.append(scan.ranges_m[:: self._stride].astype(np.float32))
            self._poses.append(pose.as_array())
            if self._odometer is not None:
                self._odometry.append((self._read_s, *self._driven.pose))
            if len(self._scans) > MOST_SCANS:
                self._scans, self._scan_t_s = self._scans[::2], self._scan_t_s[::2]
                self._poses, self._odometry = self._poses[::2], self._odometry[::2]
                self._apart_s *= 2.0

    def seen(self) -> records.Sightings:
        """What was seen, as the file keeps it."""
        out = records.Sightings()
        if self._config is not None and self._scans:
            mount = self._config.mount
            out = records.Sightings(
                scan_t_s=np.array(self._scan_t_s),
                ranges_m=np.stack(self._scans).astype(np.float64),
                scan_poses=np.stack(self._poses),
                scan_odometry=np.array(self._odometry).reshape(-1, 4),
                angles_rad=self._config.beam_angles_rad()[:: self._stride],
                mount=mount.as_array(),
                max_range_m=self._config.max_range_m,
            )
        if self._beacons is not None:
            counts = np.array([len(ids) for ids in self._seen], dtype=np.int64)
            out = replace(out, beacon_counts=counts, beacon_ids=np.concatenate([self._nothing, *self._seen]))
        return out

    def arrays(self) -> Mapping[str, Any]:
        """The sightings as arrays for one file; empty where the robot has no such sensor."""
        return records.sighting_arrays(self.seen())


def _first(sensors: dict[str, SensorConfig], config: type[Any]) -> tuple[str | None, Any]:
    """Name and config of the first sensor of a kind."""
    return next(((name, c) for name, c in sensors.items() if isinstance(c, config)), (None, None))
