"""Gyroscope and magnetometer logs: ``t, x, y, z`` in seconds and degrees a second or gauss."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.text import check_size, check_times, read_table

DRIVE_SUFFIX = ".mat"
COLUMNS = ("t", "x", "y", "z")


class HeadingSensor(StrEnum):
    """What a log's numbers are."""

    GYROSCOPE = "gyroscope"
    MAGNETOMETER = "magnetometer"


_WORDS = {
    HeadingSensor.GYROSCOPE: ("gyro",),
    HeadingSensor.MAGNETOMETER: ("compass", "magnet", "mag_"),
}


@dataclass(frozen=True, slots=True)
class HeadingLog:
    """One sensor's log.

    Attributes
    ----------
    name
        The recording's name: its folder's, or the file's own.
    t_s
        (N,) increasing, in general not evenly spaced.
    values
        (N, 3): rad/s about the axes (gyroscope) or gauss along them (magnetometer).
    place
        The file, for complaints.
    turns
        Whether something else tells that the robot turned.
    """

    name: str
    sensor: HeadingSensor
    t_s: FloatArray
    values: FloatArray
    place: str
    turns: bool = False


def read_heading_log(path: Path) -> HeadingLog:
    """Read a log; its file name says which sensor it is of.

    Raises
    ------
    InputError
        File and line of what is wrong, or a name that tells no sensor.
    """
    sensor = sensor_of(path)
    if sensor is None:
        words = sorted(word for group in _WORDS.values() for word in group)
        raise InputError(f"{path}: expected one of {', '.join(words)} in the file's name, to know the sensor")
    table = read_table(path, COLUMNS, separator=",", header=True)
    t_s = table.values[:, 0].copy()
    check_times(table, t_s)
    check_size(table, COLUMNS)
    values = table.values[:, 1:].copy()
    if sensor is HeadingSensor.GYROSCOPE:
        values *= math.pi / 180.0
    return HeadingLog(path.resolve().parent.name, sensor, t_s, values, str(path))


def sensor_of(path: Path) -> HeadingSensor | None:
    """Tell the sensor by the file's name."""
    name = path.name.lower()
    return next((kind for kind, words in _WORDS.items() if any(word in name for word in words)), None)


def find_heading_logs(place: Path) -> list[Path]:
    """Return the logs in a folder and the folders right in it (drives with a reference too), or the file.

    No deeper: what lies further down is seldom one robot's, and all logs are calibrated as one.

    Raises
    ------
    InputError
        Where nothing is there, or no log in the folder.
    """
    if not place.exists():
        raise InputError(f"{place}: expected a log or a folder of logs, found nothing there")
    if not place.is_dir():
        return [place]
    near = sorted([*place.glob("*"), *place.glob("*/*")])
    found = [path for path in near if path.suffix == ".csv" and sensor_of(path) is not None]
    found += [path for path in near if path.suffix == DRIVE_SUFFIX]
    if not found:
        raise InputError(
            f"{place}: expected gyroscope or magnetometer logs (*.csv, or *.mat of a drive) in it "
            "or in the folders right in it, found none"
        )
    return found
