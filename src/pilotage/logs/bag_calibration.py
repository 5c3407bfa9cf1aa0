"""What a calibration takes from a bag: odometry and gyroscopes beside the truth, magnetometers, ranges."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.logs.bag_kinds import FIELDS, LANDMARKS, RANGES, RATES, TRUTH, TWISTS
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
from pilotage.logs.bag_topics import Kind
from pilotage.logs.bags import ODOMETRY, SCANS, USUAL_BASES, read_bag
from pilotage.logs.heading_csv import HeadingLog, HeadingSensor
from pilotage.logs.laser_log import interpolate_poses
from pilotage.logs.mrclam import MrclamLog
from pilotage.logs.odometry_steps import OdometryForm, OdometrySteps, carried_over
from pilotage.logs.reckoning_mat import ReckoningLog
from pilotage.logs.steady_csv import LEAST_ROWS, MOST_COLUMNS, Column
from pilotage.logs.true_poses import true_poses
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.world_map import NO_LANDMARKS

STEP_S = 0.1
"""Odometry that comes more often is taken so far apart: its steps are then beyond the truth's rounding."""
TRUTH_GAP_S = 0.5
"""A step over a longer gap of the truth says nothing."""
COMMAND_HELD_S = 0.5
"""A base stops when it has heard no command for so long."""
MOST_BEAMS = 8
LARGEST_WAY_M = 0.02
"""A robot that stands does not go farther by its odometry."""
LARGEST_TURN_RAD = 0.05
"""Nor does it turn by more."""


def odometry_of_bag(path: Path, topics: Sequence[str] = (), truth: str | None = None) -> OdometrySteps:
    """Odometry beside the true poses of the same bag.

    Parameters
    ----------
    topics
        The odometry (``nav_msgs/Odometry``); by default the usual one, without any the transforms.
    truth
        As ``true_poses`` has it.

    Raises
    ------
    InputError
        Where the bag has not both; the message tells what it holds.
    """
    if len(topics) > 1:
        raise InputError(f"{path}: expected one topic of odometry, found {len(topics)}")
    claimed = read_odometry(path, topics[0] if topics else None)
    true = true_poses(path, truth)
    if true.topic == claimed.topic:
        raise InputError(
            f"{path}: expected --truth TOPIC|FILE beside the odometry {claimed.topic}, found none"
        )
    t_s, apart = [], -np.inf
    for t in claimed.t_s[(claimed.t_s >= true.t_s[0]) & (claimed.t_s <= true.t_s[-1])]:
        if t - apart >= STEP_S - 1e-6:
            t_s.append(t)
            apart = t
    at = np.array(t_s)
    if len(at) < LEAST_ROWS:
        raise InputError(
            f"{path}: expected {LEAST_ROWS} or more readings of {claimed.topic} and {true.topic} at the same "
            f"time, found {len(at)}"
        )
    read = interpolate_poses(claimed.t_s, headings(claimed.values), at)
    known = interpolate_poses(true.t_s, headings(true.values), at)
    nearest = np.searchsorted(true.t_s, at, side="right").clip(1, len(true.t_s) - 1)
    dense = true.t_s[nearest] - true.t_s[nearest - 1] <= TRUTH_GAP_S
    whole = dense[1:] & dense[:-1]
    if np.count_nonzero(whole) < LEAST_ROWS:
        raise InputError(
            f"{path}: expected {LEAST_ROWS} or more steps of {claimed.topic} with a pose of {true.topic} "
            f"every {TRUTH_GAP_S:g} s beside them, found {np.count_nonzero(whole)}; are their times right?"
        )
    moved = carried_over(known[:-1], read[:-1], read[1:])
    return OdometrySteps(
        path.stem,
        OdometryForm.CUMULATIVE,
        at[1:][whole],
        known[:-1][whole],
        known[1:][whole],
        moved[whole],
    )


def commands_of_bag(
    path: Path, topics: Sequence[str] = (), truth: str | None = None, landmarks: Landmarks = NO_LANDMARKS
) -> MrclamLog:
    """Commanded velocities beside where the robot went: by the truth, where there is any, else the odometry.

    A command holds until the next one, half a second at most, as bases take it.

    Parameters
    ----------
    topics
        The commands (``Twist``, ``TwistStamped``), the odometry (``nav_msgs/Odometry``) and detections of
        landmarks, in any order; by default the usual ones.
    truth
        As ``odometry_of_bag`` has it.
    landmarks
        Where they are in the frame of the truth; none: the detections are left out.

    Raises
    ------
    InputError
        Where the bag has not both commands and where they led, or landmarks are given and it has no truth or
        none of them; the message tells what it holds.
    """
    told: dict[Kind, str] = {}
    for asked in topics:
        name, msgtype = topic_of(path, asked)
        kind = next((k for k in (TWISTS, ODOMETRY, LANDMARKS) if msgtype in k.types), None)
        if kind is None or kind in told or (kind is LANDMARKS and not len(landmarks.ids)):
            raise InputError(
                f"{path}: topic {name}: expected one of commands ({TWISTS.types[-1]}), one of odometry "
                f"({ODOMETRY.types[0]}) and with --landmarks one of detections, found {msgtype}"
            )
        told[kind] = name
    sent = read_series(path, TWISTS, told.get(TWISTS))
    if truth is not None or len(landmarks.ids) or (ODOMETRY not in told and has(path, TRUTH)):
        went = true_poses(path, truth)
    else:
        went = read_odometry(path, told.get(ODOMETRY))
    seen = _detections(path, told.get(LANDMARKS), landmarks)
    if min(len(sent.t_s), len(went.t_s)) < LEAST_ROWS:
        raise InputError(
            f"{path}: expected {LEAST_ROWS} or more messages of {sent.topic} and of {went.topic}, found "
            f"{len(sent.t_s)} and {len(went.t_s)}"
        )
    silent = np.flatnonzero(np.diff(sent.t_s) > COMMAND_HELD_S)
    t_s = np.concatenate([sent.t_s, sent.t_s[silent] + COMMAND_HELD_S])
    rates = np.concatenate([sent.values[:, :2], np.zeros((len(silent), 2))])
    order = np.argsort(t_s, kind="stable")
    wide = np.flatnonzero(np.diff(went.t_s) > TRUTH_GAP_S)
    return MrclamLog(
        0,
        t_s[order],
        rates[order, 0],
        rates[order, 1],
        seen.t_s,
        seen.values[:, 0].astype(np.int64),
        np.hypot(seen.values[:, 1], seen.values[:, 2]),
        np.arctan2(seen.values[:, 2], seen.values[:, 1]),
        went.t_s,
        headings(went.values),
        np.column_stack([went.t_s[wide], went.t_s[wide + 1]]),
        landmarks,
    )


def _detections(path: Path, topic: str | None, landmarks: Landmarks) -> Series:
    """Of the landmarks that are known, in the robot's frame; none where none are."""
    if not len(landmarks.ids):
        return Series("", "", np.zeros(0), np.zeros((0, 4)))
    found = landmarks_in_base(path, topic, USUAL_BASES)
    known = np.isin(found.values[:, 0], landmarks.ids)
    if not known.any():
        seen = ", ".join(f"{i:g}" for i in np.unique(found.values[:, 0])[:8])
        raise InputError(f"{path}: expected landmarks of the table in {found.topic}, found only {seen}")
    return Series(found.topic, found.frame, found.t_s[known], found.values[known], found.warnings)


def headings_of_bag(path: Path, topics: Sequence[str] = ()) -> list[HeadingLog]:
    """Gyroscopes (``sensor_msgs/Imu``) and magnetometers (``MagneticField``): the usual ones, or those named.

    Raises
    ------
    InputError
        Where the bag has none; the message tells what it holds.
    """
    found = _heading_series(path, topics)
    driven = headings(read_odometry(path).values)[:, 2] if has_odometry(path) else np.zeros(1)
    turns = bool(np.ptp(np.unwrap(driven)) > LARGEST_TURN_RAD)
    return [
        HeadingLog(path.stem, sensor, s.t_s - s.t_s[0], s.values, f"{path} {s.topic}", turns)
        for sensor, s in found
    ]


def reckonings_of_bag(
    path: Path, topics: Sequence[str] = (), truth: str | None = None, axis: int = 2
) -> list[ReckoningLog]:
    """The gyroscopes of ``headings_of_bag`` beside the true heading of the same bag; none without a truth.

    Parameters
    ----------
    truth
        As ``odometry_of_bag`` has it.
    axis
        Which of the gyroscope's the robot turns about, 0 to 2.

    Raises
    ------
    InputError
        Where a gyroscope or the truth that is asked for is not there.
    """
    if truth is None and not has(path, TRUTH):
        return []
    true = true_poses(path, truth)
    out = []
    for sensor, told in _heading_series(path, topics):
        if sensor is not HeadingSensor.GYROSCOPE or len(told.t_s) < LEAST_ROWS:
            continue
        rates, dt_s = told.values[:, axis], np.diff(told.t_s)
        heading = np.unwrap(interpolate_poses(true.t_s, headings(true.values), told.t_s)[:, 2])
        after = np.searchsorted(true.t_s, told.t_s).clip(1, len(true.t_s) - 1)
        known = true.t_s[after] - true.t_s[after - 1] <= TRUTH_GAP_S
        known &= (told.t_s >= true.t_s[0]) & (told.t_s <= true.t_s[-1])
        turn = np.where(known[1:] & known[:-1], np.diff(heading), np.nan)
        out.append(ReckoningLog(path.stem, told.t_s[1:], dt_s, 0.5 * (rates[1:] + rates[:-1]) * dt_s, turn))
    return out


def _heading_series(path: Path, topics: Sequence[str]) -> list[tuple[HeadingSensor, Series]]:
    kinds = ((RATES, HeadingSensor.GYROSCOPE), (FIELDS, HeadingSensor.MAGNETOMETER))
    chosen: list[tuple[Kind, HeadingSensor, str | None]]
    if topics:
        asked = [topic_of(path, topic) for topic in topics]
        for name, msgtype in asked:
            if not any(msgtype in kind.types for kind, _ in kinds):
                raise InputError(f"{path}: topic {name}: expected {RATES} or {FIELDS}, found {msgtype}")
        chosen = [(k, s, n) for n, msgtype in asked for k, s in kinds if msgtype in k.types]
    else:
        chosen = [(kind, sensor, None) for kind, sensor in kinds if has(path, kind)]
    if not chosen:
        read_series(path, RATES)  # tells what the bag holds
    return [(sensor, read_series(path, kind, name)) for kind, sensor, name in chosen]


def steady_of_bag(path: Path, topics: Sequence[str] = ()) -> list[Column]:
    """Ranges at rest: of a few beams of a laser that always hit something, else of a ``sensor_msgs/Range``,
    else of fiducials, with their bearings.

    Raises
    ------
    InputError
        Where the bag has none, or no beam always hits; the message tells what it holds.
    """
    if len(topics) > 1:
        raise InputError(f"{path}: expected one topic of ranges, scans or landmarks, found {len(topics)}")
    asked = topic_of(path, topics[0]) if topics else None
    if has_odometry(path):
        driven = headings(read_odometry(path).values)[:, :2]
        way_m = float(np.hypot(*(driven - driven[0]).T).max())
        if way_m > LARGEST_WAY_M:
            raise InputError(f"{path}: expected a robot that stands still, found one that went {way_m:.2f} m")
    if asked is not None and asked[1] not in (*RANGES.types, *SCANS.types, *LANDMARKS.types):
        raise InputError(
            f"{path}: topic {asked[0]}: expected {RANGES}, {SCANS} or {LANDMARKS}, found {asked[1]}"
        )
    if (asked is None and has(path, SCANS)) or (asked is not None and asked[1] in SCANS.types):
        log = read_bag(path, None if asked is None else asked[0])
        always = np.flatnonzero(np.isfinite(log.ranges_m).all(axis=0))
        if len(log) < LEAST_ROWS or not always.size:
            raise InputError(
                f"{path}: expected {LEAST_ROWS} or more scans with a beam that always hits something, found "
                f"{len(log)} scans and {always.size} such beams"
            )
        beams = np.unique(always[np.linspace(0, always.size - 1, MOST_BEAMS).astype(int)])
        return [Column(f"beam_{beam}", "m", log.ranges_m[:, beam].copy()) for beam in beams]
    marked = has(path, LANDMARKS) and not has(path, RANGES) if asked is None else asked[1] in LANDMARKS.types
    if marked:
        return _steady_landmarks(path, None if asked is None else asked[0])
    found = read_series(path, RANGES, None if asked is None else asked[0])
    if len(found.t_s) < LEAST_ROWS:
        raise InputError(f"{path}: expected {LEAST_ROWS} or more ranges, found {len(found.t_s)}")
    return [Column("range", "m", found.values[:, 0].copy())]


def _steady_landmarks(path: Path, topic: str | None) -> list[Column]:
    """Range and bearing of each landmark that is seen often enough, in the sensor's frame (x looks ahead)."""
    found = read_series(path, LANDMARKS, topic)
    out = []
    for identity in np.unique(found.values[:, 0]):
        x, y = found.values[found.values[:, 0] == identity, 1:3].T
        if len(x) >= LEAST_ROWS:
            bearing = np.arctan2(y, x)
            middle = np.arctan2(np.sin(bearing).mean(), np.cos(bearing).mean())
            out.append(Column(f"landmark_{identity:g}_range", "m", np.hypot(x, y)))
            out.append(
                Column(f"landmark_{identity:g}_bearing", "rad", middle + wrap_array_to_pi(bearing - middle))
            )
    if not out:
        raise InputError(
            f"{path}: expected a landmark in {found.topic} seen {LEAST_ROWS} or more times, found none"
        )
    return out[:MOST_COLUMNS]
