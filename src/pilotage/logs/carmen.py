"""CARMEN logs, plain or gzipped: laser scans and odometry, as the Radish recordings are written.

Lines that are read (all others are passed over):

    ODOM x y theta v w acceleration ipc_time host logger_time
    FLASER n r_1 .. r_n  x y theta  odom_x odom_y odom_theta  ipc_time host logger_time
    ROBOTLASER1 type start_angle field_of_view step max_range accuracy remission_mode
        n r_1 .. r_n  m rem_1 .. rem_m  laser_x laser_y laser_theta  x y theta
        v w forward_safety side_safety turn_axis  ipc_time host logger_time

A FLASER scan says nothing of its angles: n beams are spread from -90 deg over 180 deg with steps of
180 deg / n (n = 180, the SICK scanner at one degree) or 180 deg / (n - 1) (odd n).
"""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_cut_text
from pilotage.core.types import FloatArray, IntArray
from pilotage.core.whole_number import whole_number

LARGEST = 1e12
"""Beyond any metre, radian or second of a log."""
LEAST_BEAMS = 2


@dataclass(frozen=True, slots=True)
class CarmenLog:
    """Scans and odometry in the order of the file.

    Attributes
    ----------
    t_s
        (N,) times of the scans. Real logs were not always written in the order of time.
    ranges_m
        (N, B) in beam order, counter-clockwise, as they were logged; a row shorter than B ends in NaN.
    beams
        (N,) how many entries of each row are beams.
    first_angle_rad, angle_step_rad
        (N,) direction of the first beam in the scanner's frame, and the angle to the next one.
    laser_poses, robot_poses
        (N, 3) x, y, theta as the log gives them: corrected ones in a corrected log.
    odometry_t_s, odometry
        (M,) and (M, 3) of the ODOM lines.
    readings_before
        (N,) ODOM lines before each scan.
    cut_short
        Whether the file ends within a line, which is left out then, or gzipped data have no end.
    """

    t_s: FloatArray
    ranges_m: FloatArray
    beams: IntArray
    first_angle_rad: FloatArray
    angle_step_rad: FloatArray
    laser_poses: FloatArray
    robot_poses: FloatArray
    odometry_t_s: FloatArray
    odometry: FloatArray
    readings_before: IntArray
    cut_short: bool = False

    def angles_rad(self, scan: int) -> FloatArray:
        """Return (B,) the directions of a scan's beams in the scanner's frame; B its own number of them."""
        count = np.arange(int(self.beams[scan]), dtype=np.float64)
        return np.asarray(self.first_angle_rad[scan] + self.angle_step_rad[scan] * count)


@dataclass(frozen=True, slots=True)
class _Scan:
    t_s: float
    ranges_m: array[float]
    first_rad: float
    step_rad: float
    laser: list[float]
    robot: list[float]


def read_carmen(path: Path) -> CarmenLog:
    """Read a log.

    Ranges that are no numbers are kept as NaN or infinity, scans may change their number of beams, and a last
    line that the end of the file, gzipped or not, cuts is left out.

    Raises
    ------
    InputError
        File and line of what is damaged elsewhere, or where there is no scan at all.
    """
    scans: list[_Scan] = []
    readings_before: list[int] = []
    odometry: list[list[float]] = []
    text, cut_short = read_cut_text(path, "a readable file")
    lines = text.splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words:
            continue
        where = f"{path} line {number}"
        try:
            if words[0] in {"FLASER", "ROBOTLASER1"}:
                scans.append(_flaser(words, where) if words[0] == "FLASER" else _robotlaser(words, where))
                readings_before.append(len(odometry))
            elif words[0] == "ODOM":
                _expect(words, 10, where)
                odometry.append([*_floats(words[1:4], where), *_floats(words[7:8], where)])
        except InputError:
            if number < len(lines) or text.endswith("\n") or not scans:
                raise
            cut_short = True
    if not scans:
        raise InputError(
            f"{path} line {len(lines) + 1}: expected FLASER or ROBOTLASER1 lines, found the end of the file; "
            "docs/slam.md shows how to write them from a log of your own"
        )
    beams = np.array([len(scan.ranges_m) for scan in scans], np.int64)
    ranges_m = np.full((beams.size, int(beams.max())), np.nan)
    for row, scan in enumerate(scans):
        ranges_m[row, : beams[row]] = scan.ranges_m
    poses = np.array(odometry).reshape(-1, 4)
    return CarmenLog(
        np.array([scan.t_s for scan in scans]),
        ranges_m,
        beams,
        np.array([scan.first_rad for scan in scans]),
        np.array([scan.step_rad for scan in scans]),
        np.array([scan.laser for scan in scans]),
        np.array([scan.robot for scan in scans]),
        poses[:, 3].copy(),
        poses[:, :3].copy(),
        np.array(readings_before, np.int64),
        cut_short,
    )


def _flaser(words: list[str], where: str) -> _Scan:
    beams = _count(words, 1, where)
    if beams < LEAST_BEAMS:
        raise InputError(f"{where}: FLASER: expected {LEAST_BEAMS} or more beams, found {beams}")
    _expect(words, beams + 11, where)
    ranges = _floats(words[2 : beams + 2], where, finite=False)
    numbers = _floats(words[beams + 2 : beams + 9], where)
    step = math.pi / (beams - 1 if beams % 2 else beams)
    return _Scan(numbers[6], array("d", ranges), -0.5 * math.pi, step, numbers[:3], numbers[3:6])


def _robotlaser(words: list[str], where: str) -> _Scan:
    beams = _count(words, 8, where)
    remissions = _count(words, 9 + beams, where)
    tail = 10 + beams + remissions
    _expect(words, tail + 14, where)
    first, _, step = _floats(words[2:5], where)
    numbers = _floats(words[tail : tail + 12], where)
    ranges = array("d", _floats(words[9 : 9 + beams], where, finite=False))
    return _Scan(numbers[11], ranges, first, step, numbers[:3], numbers[3:6])


def _count(words: list[str], index: int, where: str) -> int:
    """Read a whole number of values."""
    found = words[index] if len(words) > index else "the end of the line"
    count = whole_number(found)
    if count is None:
        raise InputError(f"{where}: {words[0]}: expected a number of values, found {found}")
    return count


def _expect(words: list[str], least: int, where: str) -> None:
    if len(words) < least:
        raise InputError(
            f"{where}: {words[0]}: expected {least} words, found {len(words)}; the line is cut short"
        )


def _floats(words: list[str], where: str, finite: bool = True) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise InputError(f"{where}: expected numbers, {error}") from None
    if finite and not all(math.isfinite(value) for value in values):
        raise InputError(f"{where}: expected finite numbers, found NaN or infinity")
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if largest > LARGEST:
        raise InputError(f"{where}: expected numbers within {LARGEST:g}, found {largest:g}")
    return values
