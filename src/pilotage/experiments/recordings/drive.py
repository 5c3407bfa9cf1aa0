"""A recording in one form, whatever file it came from: what was sensed, step by step, and the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, Command, FloatArray, IntArray, Pose2
from pilotage.logs.aer1513 import read_aer1513
from pilotage.logs.mrclam import TRUTH_GAP_S, MrclamLog, read_mrclam
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import (
    BeaconReadings,
    GyroscopeRates,
    LidarScan,
    OdometryIncrement,
    Reading,
    Readings,
)
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

ODOMETRY, BEACONS, LIDAR, GYROSCOPE = "odometry", "beacons", "lidar", "gyroscope"
SCORE_HZ = 10.0
HOLD_S = 0.5
"""A command is held no longer than this where the next one is missing."""
SPARE = 1.3
"""The robot may be so much faster than it was ever seen."""
MOST_M_S, MOST_RAD_S = 30.0, 30.0


@dataclass(frozen=True, slots=True)
class RecordedDrive:
    """A recording as steps.

    Attributes
    ----------
    t_s
        (K,) ends of the steps since the begin; the first is the begin itself.
    distance_m, angle_rad
        (K,) as the odometry claims for the step that ends there; nan where the log says nothing of it.
    first, ids, ranges_m, bearings_rad
        Readings first[k] to first[k + 1] were taken at step k.
    truth
        (K, 3), nan where it is not known.
    scored
        (K,) the steps that the trace keeps: of the 10 Hz grid, or of a laser's scans.
    begin_s
        The log's clock at the begin.
    misread, stale
        File and line of readings of unknown barcodes, and of an outdated first row of odometry: left out.
    rate_var
        Variances per second of the odometry's distance (m^2) and angle (rad^2), where the log gives them.
    sideways_m
        (K,) as ``distance_m``, to the left; None where the base cannot.
    part_var
        (K, 3) as ``OdometryIncrement`` has it, of odometry slower than the steps; None: it is as fast.
    scans, scan_at
        (S, B) ranges, and (K,) which of them came at a step (-1: none); None without a laser.
    turning
        Topic, and (K,) mean rate of the step by the gyroscope; nan where it is silent; None without one.
    chart
        The robot's map; None: landmarks alone.
    start
        Where the robot is told that it begins; None: nowhere, it has to find itself.
    motion
        How fast it may be, by what is known of it.
    warnings
        What was missing, damaged or put right, a sentence each.
    """

    name: str
    robot: int | None
    begin_s: float
    t_s: FloatArray
    distance_m: FloatArray
    angle_rad: FloatArray
    first: IntArray
    ids: IntArray
    ranges_m: FloatArray
    bearings_rad: FloatArray
    truth: FloatArray
    scored: BoolArray
    landmarks: Landmarks
    sensors: dict[str, SensorConfig]
    truth_gaps: int
    odometry_gaps: int
    misread: tuple[str, ...]
    motion: DifferentialDriveConfig
    rate_var: tuple[float, float] | None = None
    stale: tuple[str, ...] = ()
    sideways_m: FloatArray | None = None
    part_var: FloatArray | None = None
    scans: FloatArray | None = None
    scan_at: IntArray | None = None
    turning: tuple[str, FloatArray] | None = None
    chart: WorldMap | None = None
    start: Pose2 | None = None
    warnings: tuple[str, ...] = ()

    def readings_at(self, k: int) -> Readings:
        """What was sensed at step ``k``, as the robot's plug takes it."""
        said: dict[str, Reading] = {}
        distance_m = float(self.distance_m[k])
        if math.isfinite(distance_m):
            aside_m = 0.0 if self.sideways_m is None else float(self.sideways_m[k])
            increment = OdometryIncrement(distance_m, float(self.angle_rad[k]), aside_m)
            if self.part_var is not None:
                ahead, left, turn = self.part_var[k].tolist()
                increment = replace(increment, part_var=(ahead, left, turn))
            said[ODOMETRY] = increment
        rows = slice(int(self.first[k]), int(self.first[k + 1]))
        if rows.stop > rows.start:
            said[BEACONS] = BeaconReadings(self.ids[rows], self.ranges_m[rows], self.bearings_rad[rows])
        if self.scans is not None and self.scan_at is not None and self.scan_at[k] >= 0:
            said[LIDAR] = LidarScan(self.scans[self.scan_at[k]])
        if self.turning is not None and np.isfinite(self.turning[1][k]):
            said[GYROSCOPE] = GyroscopeRates(self.turning[1][k : k + 1])
        return Readings(float(self.t_s[k]), said)


class RecordedSource:
    """A recording as a source of readings: it says what was sensed, and cannot carry out a command.

    Attributes
    ----------
    at
        The step of the last readings.
    """

    def __init__(self, drive: RecordedDrive) -> None:
        self._drive, self.at = drive, 0

    @property
    def t_s(self) -> float:
        """Time of the last readings."""
        return float(self._drive.t_s[self.at])

    @property
    def is_over(self) -> bool:
        """Whether the recording has ended."""
        return self.at + 1 >= len(self._drive.t_s)

    def step(self, commands: Sequence[Command]) -> list[Readings]:  # noqa: ARG002
        """The next step of the recording."""
        self.at += 1
        return [self._drive.readings_at(self.at)]


def mrclam_drive(folder: Path, robot: int) -> RecordedDrive:
    """One robot of a MRCLAM data set; steps at 10 Hz and wherever a landmark was seen."""
    log = read_mrclam(folder, robot)
    known = log.of_landmarks
    if min(log.odometry_t_s.shape[0], log.truth_t_s.shape[0]) < 2:
        raise InputError(f"{folder}: expected two or more rows of odometry and truth, found fewer")
    begin = float(max(log.truth_t_s[0], log.odometry_t_s[0]))
    end = float(min(log.truth_t_s[-1], log.odometry_t_s[-1]))
    if end - begin < 1.0:
        raise InputError(
            f"{folder}: expected odometry and truth of robot {robot} over the same time, "
            f"found {max(end - begin, 0.0):.1f} s in common"
        )
    grid = begin + np.arange(int((end - begin) * SCORE_HZ) + 1) / SCORE_HZ
    inside = (log.measurement_t_s[known] > begin) & (log.measurement_t_s[known] <= end)
    known = known[inside]
    clock = np.union1d(grid, log.measurement_t_s[known])
    distance, angle = _held(clock, log)
    heading = np.unwrap(log.truth[:, 2])
    columns = (log.truth[:, 0], log.truth[:, 1], heading)
    truth = np.column_stack([np.interp(clock, log.truth_t_s, column) for column in columns])
    for left, right in log.truth_gaps_s:
        truth[(clock > left) & (clock < right)] = np.nan
    return RecordedDrive(
        f"{folder.resolve().name}-robot{robot}",
        robot,
        begin,
        clock - begin,
        distance,
        angle,
        np.searchsorted(log.measurement_t_s[known], np.append(clock, np.inf)).astype(np.int64),
        log.subjects[known],
        log.ranges_m[known],
        log.bearings_rad[known],
        truth,
        np.isin(clock, grid),
        log.landmarks,
        {
            ODOMETRY: WheelOdometryConfig(
                distance_var_m2_per_m=2e-3, angle_var_rad2_per_rad=0.01, angle_var_rad2_per_m=5e-3
            ),
            BEACONS: BeaconConfig(max_range_m=20.0, range_var_m2=0.15**2, bearing_var_rad2=0.03**2),
        },
        log.truth_gaps_s.shape[0],
        int((np.diff(log.odometry_t_s) > TRUTH_GAP_S).sum()),
        log.misread,
        limits(log.speed_m_s, log.turn_rate_rad_s),
        stale=log.stale,
        start=Pose2.from_array(truth[0]),
    )


def aer1513_drive(path: Path, max_range_m: float | None = None) -> RecordedDrive:
    """A robot with a laser; one step a row, readings beyond ``max_range_m`` left out."""
    log = read_aer1513(path)
    seen = np.isfinite(log.ranges_m)
    if max_range_m is not None:
        seen &= np.nan_to_num(log.ranges_m, nan=np.inf) <= max_range_m
    seen[0] = False
    dt = np.diff(log.t_s, prepend=log.t_s[0])
    known = np.where(dt <= HOLD_S, dt, np.nan)
    rows, columns = np.nonzero(seen)
    # The file's noise is of the rates, drawn anew each step: per metre and radian, at the usual rates.
    step = float(np.median(dt[1:]))
    speed = max(float(np.mean(np.abs(log.speed_m_s))), 1e-2)
    driving = WheelOdometryConfig(
        distance_var_m2_per_m=log.speed_var_m2_s2 * step / speed,
        angle_var_rad2_per_rad=0.0,
        angle_var_rad2_per_m=log.turn_rate_var_rad2_s2 * step / speed,
    )
    truth = log.truth.copy()
    truth[log.truth_known, 2] = np.unwrap(truth[log.truth_known, 2])  # what is unknown may be anything
    truth[~log.truth_known] = np.nan
    unknown_begins = np.flatnonzero(np.diff(log.truth_known.astype(np.int64), prepend=1) < 0)
    grid = np.concatenate([[True], np.diff(np.floor((log.t_s - log.t_s[0]) * SCORE_HZ + 1e-6)) > 0])
    return RecordedDrive(
        path.stem,
        None,
        float(log.t_s[0]),
        log.t_s - log.t_s[0],
        _between(log.speed_m_s) * known,
        _between(log.turn_rate_rad_s) * known,
        np.searchsorted(rows, np.arange(log.t_s.shape[0] + 1)).astype(np.int64),
        columns.astype(np.int64) + 1,
        log.ranges_m[seen],
        log.bearings_rad[seen],
        truth,
        grid,
        Landmarks(np.arange(1, log.points_xy_m.shape[0] + 1), log.points_xy_m),
        {
            ODOMETRY: driving,
            BEACONS: BeaconConfig(
                mount=Mount.measured(log.laser_ahead_m),
                field_of_view_rad=2.0 * np.pi,
                max_range_m=100.0,
                range_var_m2=log.range_var_m2,
                bearing_var_rad2=log.bearing_var_rad2,
            ),
        },
        int((dt > TRUTH_GAP_S).sum()) + unknown_begins.shape[0],
        int((dt > HOLD_S).sum()),
        (),
        limits(log.speed_m_s, log.turn_rate_rad_s),
        (log.speed_var_m2_s2 * step, log.turn_rate_var_rad2_s2 * step),
        start=Pose2.from_array(truth[0]) if np.isfinite(truth[0]).all() else None,
    )


def limits(speed_m_s: FloatArray, turn_rate_rad_s: FloatArray) -> DifferentialDriveConfig:
    """Limits that a recording (K,) keeps itself, but for a few leaps; where it is silent none is known."""
    speed, turn = (SPARE * float(np.quantile(np.abs(rates), 0.999)) for rates in (speed_m_s, turn_rate_rad_s))
    return DifferentialDriveConfig(
        max_speed_m_s=min(max(speed, 0.1), MOST_M_S), max_turn_rate_rad_s=min(max(turn, 0.1), MOST_RAD_S)
    )


def _between(rates: FloatArray) -> FloatArray:
    """(K,) mean rate of the step that ends at each sample: rates are taken as linear in between."""
    return np.concatenate([rates[:1], 0.5 * (rates[1:] + rates[:-1])])


def _held(clock: FloatArray, log: MrclamLog) -> tuple[FloatArray, FloatArray]:
    """Distance and angle of the steps that end at ``clock`` (K,): each command acts until the next one.

    No longer than `HOLD_S`, though: a step of which the log covers less than half is not known (nan).
    """
    t = log.odometry_t_s
    # The commands' times, and the ends of those after which the log falls silent.
    silent = np.flatnonzero(np.diff(t) > HOLD_S)
    knots = np.insert(t, silent + 1, t[silent] + HOLD_S)
    acting = np.insert(np.ones(t.shape[0]), silent + 1, 0.0)[:-1] * np.diff(knots)
    rates = [np.insert(rate, silent + 1, 0.0)[:-1] for rate in (log.speed_m_s, log.turn_rate_rad_s)]
    gone = [np.concatenate([[0.0], np.cumsum(x)]) for x in (acting, *(acting * rate for rate in rates))]
    covered, distance, angle = (np.diff(np.interp(clock, knots, x), prepend=0.0) for x in gone)
    unknown = covered < 0.5 * np.diff(clock, prepend=clock[0])
    return np.where(unknown, np.nan, distance), np.where(unknown, np.nan, angle)
