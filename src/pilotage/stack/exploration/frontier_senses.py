"""What an exploring robot takes from its sensors: motion, beams and line crossings into graph and map."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.rows import Rows
from pilotage.core.types import FloatArray
from pilotage.kernels.sheet import space as sheet_space
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.readings import (
    EncoderCounts,
    GyroscopeRates,
    InfraredReading,
    LineReading,
    Readings,
)
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.stack.exploration.frontier_config import FrontierConfig
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.localization.keyframes import NO_GYROSCOPE, GyroscopeErrors
from pilotage.stack.localization.line_crossings import CrossingDetector
from pilotage.stack.localization.sheet_smoother import SheetSmoother
from pilotage.stack.mapping.sheet_grid import SheetGrid, SheetShape
from pilotage.stack.planning.sheet_room import RecentPoints

OVER_EDGE_WIDTHS = 1.8
"""All line sensors dark for so many widths of a tape: that is no tape."""
STILL_MOST = 4
"""At rest a beam is taken so often: the same spot again and again says nothing of the wall around it."""
LOOSE_SPREAD_M = 0.0115
"""Points that belong to no wall are obstacles where they are this exact."""
STRAY_M, EXACT_SPREAD_M = 0.025, 0.006
"""Points so close to a wall and not exact may be strays of it, which would close a gap beside it."""
THIN_M = 0.009
LOOSE_INSIDE_M = 0.06
NEAR_M = 0.13
"""Beams this short are exact enough to steer clear by."""


class Senses:
    """Readings in, graph and map out.

    Attributes
    ----------
    floor
        Rows of keyframe, x, y in its frame, and 1 where a line sensor read dark there.

    Raises
    ------
    InputError
        Where the robot lacks encoders or has no infrared sensor: it would explore blindly.
    """

    def __init__(self, config: FrontierConfig, knowledge: SheetKnowledge) -> None:
        encoders = knowledge.sensors_of(WheelEncodersConfig)
        self._infrared = knowledge.sensors_of(InfraredConfig)
        if len(encoders) != 1 or not self._infrared:
            raise InputError(
                "frontier: expected wheel-encoders and at least one infrared sensor among robot.sensors, "
                f"found: {', '.join(knowledge.sensors) or 'none'}"
            )
        self._encoders, encoder = next(iter(encoders.items()))
        self._count_m = 2.0 * math.pi * knowledge.drive.wheel_radius_m / encoder.counts_per_turn
        self._dt_s = knowledge.dt_s
        gyroscopes = knowledge.sensors_of(GyroscopeConfig) if knowledge.fusion else {}
        self._gyro = next(iter(gyroscopes), None)
        lines = knowledge.sensors_of(LineSensorConfig)
        self._lines = {
            name: (
                sensor,
                CrossingDetector(knowledge.tape_width_m, knowledge.size_m, knowledge.edge_is_dark),
            )
            for name, sensor in lines.items()
        }
        self.sensors_ahead_m = max((sensor.mount.x_m for sensor in lines.values()), default=0.0)
        self.edges_seen = bool(lines) and knowledge.edge_is_dark
        self.smoother = SheetSmoother(
            config.pose,
            knowledge.initial,
            knowledge.drive.wheel_separation_m,
            NO_GYROSCOPE if self._gyro is None else _errors(gyroscopes[self._gyro]),
            knowledge.size_m,
            self.edges_seen,
            knowledge.streams.stream("explorer/landmarks"),
            knowledge.given.pose,
        )
        self._plan = knowledge.given.plan
        self.grid = SheetGrid(SheetShape.of(knowledge.size_m, knowledge.cells, config.resolution_m))
        self._tape_width_m = knowledge.tape_width_m
        self._still = 0
        self.doubts_strays = False
        start = knowledge.initial.pose
        self._dark_m, self._last_at = 0.0, (start.x_m, start.y_m)
        self.floor = Rows(4)
        self.recent = RecentPoints()

    def step(self, readings: Readings) -> bool:
        """Take in one control period; True where beams or line sensors spoke."""
        by_sensor = readings.by_sensor
        counts = by_sensor.get(self._encoders)
        rates = by_sensor.get(self._gyro) if self._gyro is not None else None
        turned = 0.0
        if isinstance(rates, GyroscopeRates):
            turned = float(rates.rates_rad_s.sum()) / rates.rates_rad_s.shape[0] * self._dt_s
        left = right = 0.0
        if isinstance(counts, EncoderCounts):
            left, right = int(counts.left.sum()) * self._count_m, int(counts.right.sum()) * self._count_m
        self.smoother.keyframes.add(left, right, turned, self._dt_s)
        if left != 0.0 or right != 0.0:
            self._still = 0
        if len(by_sensor) <= 2:
            return False
        spoke = False
        self._still += 1
        pose = self.smoother.keyframes.pose
        for name, sensor in self._infrared.items():
            reading = by_sensor.get(name)
            if isinstance(reading, InfraredReading):
                self._beam(sensor, reading, pose)
                spoke = True
        for name, (line_sensor, detector) in self._lines.items():
            line = by_sensor.get(name)
            if isinstance(line, LineReading):
                self._line(line_sensor, detector, line.dark, pose)
                spoke = True
        if spoke:
            x, y = pose[:2]
            all_dark = all(detector.is_dark for _, detector in self._lines.values())
            driven = math.hypot(x - self._last_at[0], y - self._last_at[1])
            self._dark_m = self._dark_m + driven if all_dark else 0.0
            self._last_at = x, y
            self.grid.be_at(x, y)
        return spoke

    def _beam(
        self, sensor: InfraredConfig, reading: InfraredReading, pose: tuple[float, float, float]
    ) -> None:
        mount, smoother = sensor.mount, self.smoother
        ux, uy = math.cos(mount.theta_rad), math.sin(mount.theta_rad)
        hit = not reading.saturated and reading.range_m < sensor.reliable_range_m
        length = min(reading.range_m, sensor.reliable_range_m)
        if hit and self._still <= STILL_MOST:
            smoother.add_beam(mount.x_m, mount.y_m, ux, uy, length, sensor.range_std_fraction)
            if length < NEAR_M:
                c, s = math.cos(pose[2]), math.sin(pose[2])
                x, y = mount.x_m + length * ux, mount.y_m + length * uy
                self.recent.add(pose[0] + c * x - s * y, pose[1] + s * x + c * y)
        keyframes = smoother.keyframes
        x, y = keyframes.in_frame(mount.x_m, mount.y_m)
        c, s = math.cos(keyframes.turned_rad), math.sin(keyframes.turned_rad)
        std = sensor.range_std_fraction * length
        self.grid.add_beam(
            (keyframes.count - 1.0, x, y, c * ux - s * uy, s * ux + c * uy, length, float(hit), std)
        )

    def _line(
        self,
        sensor: LineSensorConfig,
        detector: CrossingDetector,
        dark: bool,
        pose: tuple[float, float, float],
    ) -> None:
        mount, keyframes = sensor.mount, self.smoother.keyframes
        c, s = math.cos(pose[2]), math.sin(pose[2])
        at = pose[0] + c * mount.x_m - s * mount.y_m, pose[1] + s * mount.x_m + c * mount.y_m
        self.floor.add((keyframes.count - 1.0, *keyframes.in_frame(mount.x_m, mount.y_m), float(dark)))
        crossing = detector.step(dark, at, self.smoother.position_std_m)
        if crossing is not None:
            self.smoother.add_crossing(crossing.at)

    def is_over_edge(self) -> bool:
        """Whether all line sensors have read dark for longer than a tape is wide."""
        return self.edges_seen and self._dark_m > OVER_EDGE_WIDTHS * self._tape_width_m

    def floor_samples(self) -> FloatArray:
        """(M, 3) x, y on the map and 1 where a line sensor read dark."""
        rows = self.floor.values
        poses = self.smoother.keyframes.poses[rows[:, 0].astype(np.int64)]
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y = rows[:, 1], rows[:, 2]
        return np.column_stack([poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y, rows[:, 3]])

    def loose_crossings(self) -> FloatArray:
        """(K, 2) where something was crossed that is no landmark yet, away from the sheet's edge."""
        crossings = self.smoother.crossings
        points: FloatArray = crossings.seen[crossings.owner < 0][:, :2]
        size = np.array(self.grid.shape.size_m)
        inside = np.minimum(points, size - points).min(axis=1, initial=np.inf)
        return np.asarray(points[inside > LOOSE_INSIDE_M])

    def obstacles(self) -> tuple[FloatArray, FloatArray]:
        """(S, 4) walls and (P, 2) points that belong to none, confirmed by evidence or seen just now.

        Those of the floor plan where there is one.
        """
        if self._plan is not None:
            return self._plan.walls_m, self.recent.known
        smoother = self.smoother
        walls = smoother.map.walls()
        beams = smoother.beams
        spread = beams.spread[: beams.count]
        own = (beams.owner < 0) & (spread < LOOSE_SPREAD_M)
        loose, exact = beams.seen[own][:, :2], spread[own] < EXACT_SPREAD_M
        if self.doubts_strays and loose.shape[0] and walls.shape[0]:
            off = sheet_space.clearances(loose, walls)
            loose = loose[exact | (off > STRAY_M)]
        if loose.shape[0]:
            loose = loose[self.grid.is_occupied(loose)]
            loose = thinned(loose)
        return walls, np.concatenate([loose.reshape(-1, 2), self.recent.known])


def thinned(points_m: FloatArray) -> FloatArray:
    """(P, 2) the mean of the points (N, 2) in each square of ``THIN_M``."""
    squares, owner, counts = np.unique(
        np.floor(points_m / THIN_M), axis=0, return_inverse=True, return_counts=True
    )
    sums = np.zeros_like(squares)
    np.add.at(sums, owner.ravel(), points_m)
    means: FloatArray = sums / counts[:, None]
    return means


def _errors(gyro: GyroscopeConfig) -> GyroscopeErrors:
    """What the data sheet says, a little more carefully."""
    return GyroscopeErrors(
        walk_rad_sqrt_s=1.3 * gyro.rate_std_rad_s / math.sqrt(gyro.rate_hz) + 5e-5,
        drift_rad_s_sqrt_s=1.5 * gyro.bias_walk_rad_s_sqrt_s + 2e-5,
        bias_std=2.0 * gyro.bias_rad_s + 1e-4,
        scale_std=1.5 * gyro.scale_error + 1e-4,
    )
