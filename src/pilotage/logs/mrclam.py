"""The UTIAS multi-robot data set (Leung et al., IJRR 2011): one robot's log with truth and landmarks.

Files of one folder: ``RobotN_Odometry.dat`` (t, v, w: logged velocity commands), ``RobotN_Measurement.dat``
(t, barcode, range, bearing), ``RobotN_Groundtruth.dat`` (t, x, y, theta), ``Barcodes.dat`` (subject,
barcode) and ``Landmark_Groundtruth.dat`` (subject, x, y, std x, std y). Subjects 1-5 are robots.

The camera now and then misreads a barcode (3 of 2399 readings of robot 4 in set 6). Such readings are left
out and named; where they are more than one in a hundred, the barcodes and the measurements do not belong
together and the log is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.text import Table, check_size, check_times, read_table
from pilotage.maps.landmark_table import LARGEST_ID
from pilotage.maps.landmarks import Landmarks

LANDMARKS = "Landmark_Groundtruth.dat"
ROBOTS = range(1, 6)
"""Subjects that move; the others are landmarks."""
TRUTH_GAP_S = 0.5
"""Longer than this without truth is a gap: nothing can be scored in it."""
MISREAD_SHARE = 0.01
"""More unknown barcodes than this share of the readings are no misreadings."""
STALE_S = 0.2
"""A first row of odometry that is stamped so little after the second one is a rest from before the log."""
BARCODES = range(1, 100)
"""Barcodes have two digits; what is outside comes from a damaged file."""


@dataclass(frozen=True, slots=True)
class MrclamLog:
    """One robot's recording.

    Attributes
    ----------
    odometry_t_s, speed_m_s, turn_rate_rad_s
        (N,) logged velocity commands. Times are rounded to milliseconds, so two rows may share one.
    measurement_t_s, subjects, ranges_m, bearings_rad
        (M,) in the order of time; robots and landmarks, by subject.
    truth_t_s, truth
        (K,) and (K, 3) x, y, theta.
    truth_gaps_s
        (G, 2) begin and end of the stretches over 0.5 s without truth.
    landmarks
        The known points, by subject.
    misread
        File and line of the readings that were left out because nobody wears their barcode.
    stale
        File and line of a first row of the odometry that was left out because it is older than it says.
    """

    robot: int
    odometry_t_s: FloatArray
    speed_m_s: FloatArray
    turn_rate_rad_s: FloatArray
    measurement_t_s: FloatArray
    subjects: IntArray
    ranges_m: FloatArray
    bearings_rad: FloatArray
    truth_t_s: FloatArray
    truth: FloatArray
    truth_gaps_s: FloatArray
    landmarks: Landmarks
    misread: tuple[str, ...] = ()
    stale: tuple[str, ...] = ()

    @property
    def of_landmarks(self) -> IntArray:
        """Rows of the measurements that are of landmarks, not of robots."""
        return np.flatnonzero(np.isin(self.subjects, self.landmarks.ids)).astype(np.int64)


def read_mrclam(folder: Path, robot: int) -> MrclamLog:
    """Read one robot's recording.

    Raises
    ------
    InputError
        File and line of what is missing, not finite, backward in time, or of a barcode that nobody wears.
    """
    if robot not in ROBOTS:
        raise InputError(f"{folder}: expected a robot from {ROBOTS[0]} to {ROBOTS[-1]}, found {robot}")
    if not folder.is_dir():
        raise InputError(f"{folder}: expected the folder of a MRCLAM data set, found none there")
    path, columns = folder / f"Robot{robot}_Odometry.dat", ("t_s", "v_m_s", "w_rad_s")
    odometry, stale = _without_stale_row(read_table(path, columns))
    _check_timed(odometry, columns, repeats=True, least=2)
    # One camera picture shows several barcodes at the same time.
    seen = _timed(
        folder / f"Robot{robot}_Measurement.dat", ("t_s", "barcode", "range_m", "bearing_rad"), repeats=True
    )
    truth = _timed(folder / f"Robot{robot}_Groundtruth.dat", ("t_s", "x_m", "y_m", "theta_rad"), least=2)
    t_s = truth.values[:, 0].copy()
    wide = np.flatnonzero(np.diff(t_s) > TRUTH_GAP_S)
    negative = np.flatnonzero(seen.values[:, 2] < 0.0)
    if negative.size:
        raise InputError(
            f"{seen.place(int(negative[0]))}: range_m: expected a range >= 0, found a negative one"
        )
    barcodes, landmarks = read_barcodes(folder / "Barcodes.dat"), read_landmarks(folder / LANDMARKS)
    subjects, misread = _subjects(seen, barcodes, {*ROBOTS, *landmarks.ids.tolist()})
    known = subjects >= 0
    return MrclamLog(
        robot,
        odometry.values[:, 0].copy(),
        odometry.values[:, 1].copy(),
        odometry.values[:, 2].copy(),
        seen.values[known, 0],
        subjects[known],
        seen.values[known, 2],
        seen.values[known, 3],
        t_s,
        truth.values[:, 1:].copy(),
        np.column_stack([t_s[wide], t_s[wide + 1]]),
        landmarks,
        misread,
        stale,
    )


def read_barcodes(path: Path) -> dict[int, int]:
    """Read which subject wears which barcode; returns barcode to subject."""
    table = read_table(path, ("subject", "barcode"))
    pairs: dict[int, int] = {}
    for row in range(table.values.shape[0]):
        subject, barcode = _whole(table, row, 0, "subject"), _whole(table, row, 1, "barcode")
        if barcode in pairs:
            raise InputError(f"{table.place(row)}: expected every barcode once, found {barcode} again")
        pairs[barcode] = subject
    return pairs


def read_landmarks(path: Path) -> Landmarks:
    """Read the landmarks' places, by subject."""
    columns = ("subject", "x_m", "y_m", "x_std_m", "y_std_m")
    table = read_table(path, columns)
    check_size(table, columns)
    ids = [_whole(table, row, 0, "subject") for row in range(table.values.shape[0])]
    seen: set[int] = set()
    for row, subject in enumerate(ids):
        if subject in seen:
            raise InputError(f"{table.place(row)}: expected every subject once, found {subject} again")
        seen.add(subject)
    return Landmarks(np.array(ids, dtype=np.int64), table.values[:, 1:3])


def _timed(path: Path, columns: tuple[str, ...], *, repeats: bool = False, least: int = 1) -> Table:
    table = read_table(path, columns)
    _check_timed(table, columns, repeats=repeats, least=least)
    return table


def _check_timed(table: Table, columns: tuple[str, ...], *, repeats: bool, least: int) -> None:
    if table.values.shape[0] < least:
        raise InputError(f"{table.place(-1)}: expected {least} or more rows, found the end of the file")
    check_times(table, table.values[:, 0], repeats=repeats)
    check_size(table, columns)


def _without_stale_row(table: Table) -> tuple[Table, tuple[str, ...]]:
    """Leave out a first row that is stamped shortly after the second: the drive's buffer from before.

    Four of the five robots of set 9 begin with such a row, at a speed that they do not have. Times that go
    back anywhere else stay an error.
    """
    t_s = table.values[:, 0]
    if t_s.shape[0] < 3 or not 0.0 < t_s[0] - t_s[1] <= STALE_S or np.any(np.diff(t_s[1:]) < 0.0):
        return table, ()
    return Table(table.path, table.values[1:], table.lines[1:]), (table.place(0),)


def _subjects(seen: Table, barcodes: dict[int, int], placed: set[int]) -> tuple[IntArray, tuple[str, ...]]:
    """Subjects (M,) of the readings, -1 where nobody known wears the barcode, and where those stand."""
    subjects = np.full(seen.values.shape[0], -1, dtype=np.int64)
    unknown: list[str] = []
    for row in range(subjects.shape[0]):
        barcode = _whole(seen, row, 1, "barcode")
        subject = barcodes.get(barcode, -1)
        if subject in placed:
            subjects[row] = subject
            continue
        unknown.append(seen.place(row))
        if barcode not in BARCODES or len(unknown) > MISREAD_SHARE * subjects.shape[0]:
            what = f"a subject of {LANDMARKS}" if barcode in barcodes else "a barcode of Barcodes.dat"
            found = f"{subject} (barcode {barcode})" if barcode in barcodes else str(barcode)
            raise InputError(
                f"{seen.place(row)}: expected {what}, found {found}"
                + (f"; {len(unknown)} unknown ones so far" if len(unknown) > 1 else "")
            )
    return subjects, tuple(unknown)


def _whole(table: Table, row: int, column: int, name: str) -> int:
    value = float(table.values[row, column])
    if value != int(value) or abs(value) > LARGEST_ID:
        raise InputError(f"{table.place(row)}: {name}: expected a whole number, found {value:g}")
    return int(value)
