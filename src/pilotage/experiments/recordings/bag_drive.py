"""A bag, an MCAP file or a CARMEN log as a recorded drive: odometry, scans and landmarks step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.experiments.recordings.bag_gyroscope import SHEET as GYROSCOPE_SHEET
from pilotage.experiments.recordings.bag_gyroscope import bag_gyroscope
from pilotage.experiments.recordings.drive import (
    BEACONS,
    GYROSCOPE,
    HOLD_S,
    LIDAR,
    ODOMETRY,
    SPARE,
    RecordedDrive,
    limits,
)
from pilotage.logs.bag_kinds import LANDMARKS, RATES, TRUTH, TWISTS
from pilotage.logs.bag_messages import is_bag
from pilotage.logs.bag_series import (
    Series,
    has,
    has_odometry,
    headings,
    landmarks_in_base,
    read_odometry,
    read_series,
    topic_of,
)
from pilotage.logs.bags import ODOMETRY as WHEELS
from pilotage.logs.bags import SCANS
from pilotage.logs.laser_log import LaserLog, interpolate_poses
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.true_poses import true_poses
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.numbers import FARTHEST_M
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

LARGEST_STEP_S, FILL_S, MOST_FILLED_S = 0.2, 0.1, 100_000.0
"""Between readings farther apart than the first the odometry moves the robot in steps of the second."""
PART_SHARE = 0.25
"""Density of the doubt which part of a slow increment is whose, in squares of what the rate changes by from
one to the next, times their length: twice what a rate that changes evenly is off by in the middle."""
BASES = ("base_link", "base_footprint")
WHEEL_NOISE = WheelOdometryConfig(
    distance_var_m2_per_m=2e-3, angle_var_rad2_per_rad=0.01, angle_var_rad2_per_m=5e-3
)
"""Of a robot that nobody has calibrated; that of the MRCLAM robots."""
LASER_VAR_M2 = 0.02**2
BEACON_VAR_M2, BEACON_VAR_RAD2 = 0.1**2, 0.03**2
LARGEST_RANGE_M = 1000.0


@dataclass(frozen=True, slots=True)
class BagTopics:
    """Topics by what they hold; None: the usual one, where there is one."""

    scan: str | None = None
    odometry: str | None = None
    twist: str | None = None
    gyroscope: str | None = None
    landmarks: str | None = None

    @staticmethod
    def named(log: Path, topics: Sequence[str]) -> BagTopics:
        """Topics by their names alone, each what its type says.

        Raises
        ------
        InputError
            Where one is not in the bag, or of a type that localization has no use for.
        """
        kinds = {
            "scan": SCANS,
            "odometry": WHEELS,
            "twist": TWISTS,
            "gyroscope": RATES,
            "landmarks": LANDMARKS,
        }
        found: dict[str, str] = {}
        for asked in topics:
            name, msgtype = topic_of(log, asked)
            role = next((role for role, kind in kinds.items() if msgtype in kind.types), None)
            if role is None:
                known = ", ".join(kind.types[0] for kind in kinds.values())
                raise InputError(f"{log}: topic {name}: expected one of {known}, found {msgtype}")
            found[role] = name
        return BagTopics(**found)


def bag_drive(
    log: Path,
    chart: WorldMap,
    *,
    start: Pose2 | Literal["unknown"] | None = None,
    topics: Sequence[str] = (),
    truth: str | None = None,
    from_s: float = 0.0,
    to_s: float = np.inf,
) -> RecordedDrive:
    """Read a recording against a map.

    Odometry is a topic of ``nav_msgs/Odometry``, else the transforms, else velocities that are integrated; a
    gyroscope is taken along where the bag has one. Scans are used where the map has walls, landmarks where it
    has landmarks.

    Parameters
    ----------
    start
        Where the robot was at the first reading, or that this is unknown; None: where ``truth`` says, if it
        does.
    topics
        Of a bag, where the usual ones are not meant.
    truth
        A topic of poses in the map (``/tf:PARENT:CHILD`` for transforms) or a TUM file with the bag's clock.
        None: the usual names; without any the run is judged by what it says itself.
    from_s, to_s
        The part of the recording, in seconds since its first reading.

    Raises
    ------
    InputError
        Where the recording lacks what is needed; the message tells what it holds.
    """
    bag = is_bag(log)
    if topics and not bag:
        raise InputError(f"{log}: expected a bag where topics are named, found a log without topics")
    wanted = BagTopics.named(log, topics) if topics else BagTopics()
    said: list[str] = []
    laser = _laser(log, chart, wanted, bag)
    seen = _landmarks(log, chart, wanted, said) if bag else None
    if laser is None and seen is None:
        has_walls, marked = chart.geometry is not None or chart.grid is not None, len(chart.landmarks.ids) > 0
        needed = [f"scans ({SCANS})"] * has_walls + [f"landmarks ({LANDMARKS.types[0]} ...)"] * marked
        read_series(log, LANDMARKS if marked and not has_walls else SCANS)  # tells what the bag holds
        raise InputError(f"{log}: expected {' or '.join(needed)} for the map '{chart.name}', found none")
    if laser is not None:
        said += [warning for warning in laser.warnings if warning != "no odometry"]
    odometry_t_s, odometry = _odometry(log, laser, wanted, said)
    events = np.unique(np.concatenate([*([laser.t_s] if laser else []), *([seen.t_s] if seen else [])]))
    begin, end = max(events[0], odometry_t_s[0]), min(events[-1], odometry_t_s[-1])
    begin, end = max(begin, events[0] + from_s), min(end, events[0] + to_s)
    events = events[(events >= begin) & (events <= end)]
    if len(events) < 2:
        raise InputError(
            f"{log}: expected odometry and {'scans' if laser else 'landmarks'} over the same time, "
            f"found {len(events)} readings in common"
        )
    clock = _filled(log, events)
    moves = _moves(interpolate_poses(odometry_t_s, odometry, clock))
    sensors: dict[str, SensorConfig] = {ODOMETRY: WHEEL_NOISE}
    scans, scan_at = None, None
    if laser is not None:
        sensors[LIDAR] = sheet = _sheet(laser)
        scans, scan_at = _scans(laser, sheet), _last_at(clock, laser.t_s)
    rows, first = np.zeros((0, 4)), np.zeros(len(clock) + 1, dtype=np.int64)
    if seen is not None:
        inside = (seen.t_s > begin) & (seen.t_s <= end) & np.isin(seen.values[:, 0], chart.landmarks.ids)
        away_m = np.hypot(seen.values[:, 1], seen.values[:, 2])
        near = SPARE * away_m <= FARTHEST_M
        if (inside & ~near).any():
            said.append(
                f"{np.count_nonzero(inside & ~near)} landmarks farther than any sensor sees were left out"
            )
        inside &= near
        rows = seen.values[inside]
        first = np.searchsorted(seen.t_s[inside], np.append(clock, np.inf)).astype(np.int64)
        reach = float(away_m[inside].max(initial=1.0))
        sensors[BEACONS] = BeaconConfig(
            max_range_m=SPARE * reach, range_var_m2=BEACON_VAR_M2, bearing_var_rad2=BEACON_VAR_RAD2
        )
        if not len(rows):
            raise InputError(
                f"{log}: expected landmarks of the map in {seen.topic}, found only the identities "
                f"{', '.join(f'{i:g}' for i in np.unique(seen.values[:, 0])[:8])}"
            )
    wheels = (odometry_t_s, odometry)
    turning = bag_gyroscope(log, wanted.gyroscope, BASES, clock, wheels, said) if bag else None
    if turning is not None:
        sensors[GYROSCOPE] = GYROSCOPE_SHEET
    known = _truth(log, truth, clock, bag)
    gaps = int((np.diff(odometry_t_s) > HOLD_S).sum())
    steps_s = _periods_s(clock)
    return RecordedDrive(
        log.name.split(".")[0],
        None,
        float(begin),
        clock - begin,
        moves[:, 0],
        moves[:, 2],
        first,
        rows[:, 0].astype(np.int64),
        np.hypot(rows[:, 1], rows[:, 2]),
        np.arctan2(rows[:, 2], rows[:, 1]),
        known,
        np.isin(clock, events),
        chart.landmarks,
        sensors,
        0,
        gaps,
        (),
        sideways_m=moves[:, 1],
        part_var=_part_var(odometry_t_s, odometry, clock, np.isin(clock, events)),
        scans=scans,
        scan_at=scan_at,
        chart=chart,
        start=_told_start(start, known[0]),
        turning=turning,
        motion=limits(np.hypot(moves[1:, 0], moves[1:, 1]) / steps_s, moves[1:, 2] / steps_s),
        warnings=tuple(said),
    )


def _told_start(start: Pose2 | Literal["unknown"] | None, truth: FloatArray) -> Pose2 | None:
    """What the robot is told: the pose that is given, else the truth (3,) where it is known."""
    if start is None:
        return Pose2.from_array(truth) if np.isfinite(truth).all() else None
    return start if isinstance(start, Pose2) else None


def _laser(log: Path, chart: WorldMap, wanted: BagTopics, bag: bool) -> LaserLog | None:
    """The scans, where the map has something that they could show and the recording has any."""
    if chart.geometry is None and chart.grid is None:
        return None
    if bag and wanted.scan is None and not has(log, SCANS):
        return None
    return read_laser_log(log, wanted.scan, wanted.odometry)


def _landmarks(log: Path, chart: WorldMap, wanted: BagTopics, said: list[str]) -> Series | None:
    """Landmarks in the robot's frame, where the map and the recording have any."""
    if not len(chart.landmarks.ids) or (wanted.landmarks is None and not has(log, LANDMARKS)):
        return None
    found = landmarks_in_base(log, wanted.landmarks, BASES)
    said += found.warnings
    return found


def _odometry(
    log: Path, laser: LaserLog | None, wanted: BagTopics, said: list[str]
) -> tuple[FloatArray, FloatArray]:
    """Times (M,) and poses (M, 3) in a frame of their own."""
    if wanted.twist is not None:
        t_s, poses = _integrated(read_series(log, TWISTS, wanted.twist))
    elif laser is not None and laser.odometry is not None and laser.odometry_t_s is not None:
        t_s, poses = laser.odometry_t_s, laser.odometry
    elif is_bag(log) and (wanted.odometry is not None or has_odometry(log)):
        found = read_odometry(log, wanted.odometry)
        t_s, poses = found.t_s, headings(found.values)
    elif is_bag(log) and has(log, TWISTS):
        told = read_series(log, TWISTS)
        said.append(f"no odometry: the velocities of {told.topic} are integrated")
        t_s, poses = _integrated(told)
    else:
        read_series(log, WHEELS)  # tells what the bag holds
        raise InputError(f"{log}: expected odometry, found none")
    if len(t_s) < 2:
        raise InputError(f"{log}: expected two or more readings of odometry, found {len(t_s)}")
    return t_s, poses


def _integrated(told: Series) -> tuple[FloatArray, FloatArray]:
    """Poses of velocities that each hold until the next one, but no longer than a command is held."""
    held = np.minimum(np.diff(told.t_s), HOLD_S)[:, None]
    steps = told.values[:-1][:, [0, 2, 1]] * held
    heading = np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    middle = heading[:-1] + 0.5 * steps[:, 2]
    c, s = np.cos(middle), np.sin(middle)
    along = np.column_stack([c * steps[:, 0] - s * steps[:, 1], s * steps[:, 0] + c * steps[:, 1]])
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(along, axis=0)])
    return told.t_s, np.column_stack([places, wrap_array_to_pi(heading)])


def _filled(log: Path, events: FloatArray) -> FloatArray:
    """The times of readings, and times between those that are far apart."""
    apart_s = np.diff(events)
    gaps = np.flatnonzero(apart_s > LARGEST_STEP_S)
    if apart_s[gaps].sum() > MOST_FILLED_S:
        raise InputError(
            f"{log}: expected readings with at most {MOST_FILLED_S:g} s without any in all, found "
            f"{apart_s[gaps].sum():g} s; are their times right? --from and --to take a part"
        )
    between = [np.arange(events[k] + FILL_S, events[k + 1] - 0.5 * FILL_S, FILL_S) for k in gaps]
    return np.unique(np.concatenate([events, *between]))


def _moves(poses: FloatArray) -> FloatArray:
    """(K, 3) distance along the arc, to the left, and angle from each pose to the next; the first is none."""
    step, turn = np.diff(poses[:, :2], axis=0), wrap_array_to_pi(np.diff(poses[:, 2]))
    middle = poses[:-1, 2] + 0.5 * turn
    c, s = np.cos(middle), np.sin(middle)
    stretch = np.sinc(turn / (2.0 * np.pi))
    along = (c * step[:, 0] + s * step[:, 1]) / stretch
    aside = (c * step[:, 1] - s * step[:, 0]) / stretch
    return np.concatenate([np.zeros((1, 3)), np.column_stack([along, aside, turn])])


def _periods_s(t_s: FloatArray) -> FloatArray:
    """(M - 1,) times between readings, none shorter than on the mean.

    Readings that are stamped when they arrive come in bursts after each pause: what lies a millisecond apart
    there was driven in a usual period.
    """
    periods_s = np.diff(t_s)
    return np.maximum(periods_s, max(float(np.minimum(periods_s, HOLD_S).mean()), 1e-3))


def _part_var(t_s: FloatArray, poses: FloatArray, clock: FloatArray, read: BoolArray) -> FloatArray:
    """(K, 3) variances of which part of an increment of slow odometry the steps are: ahead, aside, turn.

    Between two poses (M, 3) of the odometry the way is taken to be even. It is not where the robot sets out,
    brakes or turns; by how much its rates change to the next increments tells, as a Brownian bridge
    q t (1 - t / T) of a stretch of length t. What a reading adds is of the stretches since the one before
    (``read``, (K,)): steps in between that the clock alone asked for are parts of a whole that is known.
    """
    out = np.zeros((len(clock), 3))
    changes = np.diff(_moves(poses)[1:] / _periods_s(t_s)[:, None], axis=0) ** 2
    if not len(changes):
        return out
    periods_s = np.maximum(np.diff(t_s), 1e-3)
    most = np.maximum(np.concatenate([changes[:1], changes]), np.concatenate([changes, changes[-1:]]))

    def bridge(within: IntArray, stretch_s: FloatArray) -> FloatArray:
        whole_s = periods_s[within]
        parts_s2 = stretch_s * np.maximum(whole_s - stretch_s, 0.0)
        return np.asarray(PART_SHARE * most[within] * parts_s2[:, None])

    at_s = clock[read]
    last = len(periods_s) - 1
    ends = np.clip(np.searchsorted(t_s, at_s[1:], side="left") - 1, 0, last)
    begins = np.clip(np.searchsorted(t_s, at_s[:-1], side="right") - 1, 0, last)
    same = (begins == ends)[:, None]
    rest = bridge(begins, t_s[begins + 1] - at_s[:-1]) + bridge(ends, at_s[1:] - t_s[ends])
    out[np.flatnonzero(read)[1:]] = np.where(same, bridge(ends, np.diff(at_s)), rest)
    return out


def _sheet(laser: LaserLog) -> LidarConfig:
    """The scanner as most of its scans have it; its middle beam is its direction."""
    beams = int(np.median(laser.beams))
    step = float(np.median(laser.angle_step_rad)) if beams > 1 else 1e-3
    first = (
        float(np.median(laser.first_angle_rad[laser.beams == beams])) if (laser.beams == beams).any() else 0.0
    )
    view = min(step * (beams - 1), 2.0 * np.pi) if beams > 1 else 1e-3
    measured = laser.ranges_m[np.isfinite(laser.ranges_m)]
    reach = min(laser.range_max_m, LARGEST_RANGE_M, float(measured.max(initial=1.0)) + 1.0)
    middle = first + 0.5 * view if beams > 1 else first
    return LidarConfig(
        mount=Mount.measured(
            laser.mount.x_m,
            laser.mount.y_m,
            float(wrap_array_to_pi(np.array([laser.mount.theta_rad + middle]))[0]),
        ),
        beams=beams,
        field_of_view_rad=view,
        max_range_m=reach,
        range_var_m2=LASER_VAR_M2,
    )


def _scans(laser: LaserLog, sheet: LidarConfig) -> FloatArray:
    """(S, B) the scans along the sheet's beams; what measured nothing says nothing."""
    middle = sheet.mount.theta_rad - laser.mount.theta_rad
    out = np.empty((len(laser), sheet.beams))
    for k in range(len(laser)):
        ranges = laser.ranges_m[k, : laser.beams[k]]
        out[k] = sheet.along_own_beams(
            ranges, float(laser.first_angle_rad[k]) - middle, float(laser.angle_step_rad[k])
        )
    return out


def _last_at(clock: FloatArray, t_s: FloatArray) -> IntArray:
    """(K,) the last of the readings at each time; -1 where there is none."""
    last = np.searchsorted(t_s, clock, side="right") - 1
    there = (last >= 0) & (t_s[np.maximum(last, 0)] == clock)
    return np.where(there, last, -1).astype(np.int64)


def _truth(log: Path, truth: str | None, clock: FloatArray, bag: bool) -> FloatArray:
    """(K, 3) true poses; nan where nobody knows."""
    nobody = np.full((len(clock), 3), np.nan)
    if (truth is not None and Path(truth).is_file()) or (bag and (truth is not None or has(log, TRUTH))):
        found = true_poses(log, truth)
        t_s, poses = found.t_s, headings(found.values)
    elif truth is not None:
        raise InputError(f"--truth: expected a TUM file or a bag's topic, found neither: '{truth}'")
    else:
        return nobody
    out = interpolate_poses(t_s, poses, clock)
    before = np.clip(np.searchsorted(t_s, clock, side="right") - 1, 0, max(len(t_s) - 2, 0))
    wide = np.diff(t_s)[before] > HOLD_S if len(t_s) > 1 else np.ones(len(clock), dtype=np.bool_)
    out[(clock < t_s[0] - HOLD_S) | (clock > t_s[-1] + HOLD_S) | wide] = np.nan
    return out
