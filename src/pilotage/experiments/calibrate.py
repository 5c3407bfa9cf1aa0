"""From logs, or from runs driven for it, to a calibration folder: JSON, the data, a parameter file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.calibration.heading import AXES, calibrate_heading
from pilotage.calibration.odometry import LogErrors, OdometryCalibration, calibrate_odometry
from pilotage.calibration.odometry_summary import odometry_summary
from pilotage.calibration.parameter_file import parameter_yaml
from pilotage.calibration.steady import SteadyReadings, calibrate_steady
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.experiments.calibration_runs import drive_odometry_runs, listen_in_the_room
from pilotage.logs.bag_calibration import (
    headings_of_bag,
    odometry_of_bag,
    reckonings_of_bag,
    steady_of_bag,
)
from pilotage.logs.bag_messages import is_bag
from pilotage.logs.heading_csv import DRIVE_SUFFIX, HeadingSensor, find_heading_logs, read_heading_log
from pilotage.logs.odometry_csv import read_odometry_csv
from pilotage.logs.odometry_steps import OdometrySteps
from pilotage.logs.reckoning_mat import read_reckoning_mat
from pilotage.logs.run_trace import TRACE, read_run_odometry
from pilotage.logs.steady_csv import read_steady_csv
from pilotage.records import calibration as records
from pilotage.records.calibration import PARAMETER_FILE
from pilotage.sensors.wheel_odometry import WheelOdometryConfig


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """The JSON object and the folder that holds it with its data."""

    answer: dict[str, object]
    folder: Path


def odometry_from(
    places: Sequence[Path],
    out: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int = 0,
    wheel_base_m: float | None = None,
    sensor: str = "odometry",
    topics: Sequence[str] = (),
    truth: str | None = None,
) -> CalibrationResult:
    """Calibrate odometry from bags, CSV files, folders of them and run folders, or drive the runs first."""
    given = None
    if not places:
        if truth or topics:  # before any run is driven for nothing
            raise InputError("calibrate odometry: expected bags where topics are named, found no recordings")
        folders, given = drive_odometry_runs(overrides, seed, out)
        places = folders
    logs = _unique([log for place in places for log in _odometry_logs(place, topics, truth)])
    found = calibrate_odometry(logs)
    answer = {"calibration": "odometry", "simulated": given is not None}
    answer |= odometry_summary(found, wheel_base_m)
    if given is not None:
        answer["given"] = _held(found, given)
    data = {f"{i}/{key}": value for i, log in enumerate(found.logs) for key, value in _arrays(log).items()}
    return write_calibration(out, answer, data, {PARAMETER_FILE: parameter_yaml(found, sensor)})


def range_from(
    places: Sequence[Path],
    out: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int = 0,
    topics: Sequence[str] = (),
) -> CalibrationResult:
    """Calibrate range sensors from bags and CSV files of readings at rest, or listen in the room first."""
    if places:
        series = [
            SteadyReadings(path.stem, column.quantity, column.unit, column.values)
            for path in places
            for column in (steady_of_bag(path, topics) if _a_bag(path, topics) else read_steady_csv(path))
        ]
    else:
        series = listen_in_the_room(overrides, seed)
    found = [calibrate_steady(readings) for readings in series]
    answer: dict[str, object] = {"calibration": "range", "simulated": not places}
    for result in found:
        r = result.readings
        quantity = r.quantity.partition(" ")[0]
        answer[f"{r.sensor}_{quantity}_var_{r.unit}2"] = result.var.as_dict()
        answer[f"{r.sensor}_{quantity}_mean_{r.unit}"] = result.mean.as_dict()
    answer["sensors"] = [result.as_dict() for result in found]
    answer["warnings"] = [result.warning for result in found if result.warning]
    data = {str(i): result.readings.values for i, result in enumerate(found)}
    return write_calibration(out, answer, data, {})


def heading_from(
    places: Sequence[Path],
    out: Path,
    *,
    axis: str = "z",
    topics: Sequence[str] = (),
    truth: str | None = None,
) -> CalibrationResult:
    """Calibrate gyroscopes and magnetometers from their logs and from bags, these against their truth too."""
    if not places:
        raise InputError(
            "calibrate heading: expected gyroscope or magnetometer logs; "
            "the simulated robot has no such sensor"
        )
    bags = [place for place in places if _a_bag(place, [*topics, *([truth] if truth else [])])]
    paths = [path for place in places if place not in bags for path in find_heading_logs(place)]
    logs = [read_heading_log(path) for path in paths if path.suffix != DRIVE_SUFFIX]
    logs += [log for bag in bags for log in headings_of_bag(bag, topics)]
    drives = [read_reckoning_mat(path) for path in paths if path.suffix == DRIVE_SUFFIX]
    if axis in AXES:
        drives += [drive for bag in bags for drive in reckonings_of_bag(bag, topics, truth, AXES.index(axis))]
    found = calibrate_heading(logs, axis, drives)
    answer = {"calibration": "heading", "simulated": False, **found.as_dict()}
    told = {drive.name for drive in drives}
    answer["warnings"] = [
        f"{log.place}: the robot turned; its true heading (--truth TOPIC) would tell bias and scale"
        for log in logs
        if log.turns and log.name not in told and log.sensor is HeadingSensor.GYROSCOPE
    ]
    data: dict[str, FloatArray] = {}
    for i, log in enumerate(logs):
        data |= {f"{i}/{log.sensor}/t_s": log.t_s, f"{i}/{log.sensor}/values": log.values}
    for i, drive in enumerate(found.drives):
        data |= {f"drive-{i}/t_s": drive.log.t_s, f"drive-{i}/drift_rad": drive.drift_rad}
    return write_calibration(out, answer, data, {})


def _a_bag(place: Path, topics: Sequence[str]) -> bool:
    """Whether a recording is a bag; InputError where topics are asked of one that is none."""
    if place.exists() and is_bag(place):
        return True
    if topics:
        raise InputError(f"{place}: expected a bag where topics are named, found none")
    return False


def _odometry_logs(place: Path, topics: Sequence[str], truth: str | None) -> list[OdometrySteps]:
    """Read a bag, a CSV file, a run folder, or all CSV files of a folder."""
    if _a_bag(place, [*topics, *([truth] if truth else [])]):
        return [odometry_of_bag(place, topics, truth)]
    if not place.is_dir():
        return [read_odometry_csv(place)]
    files = sorted(place.glob("*.csv"))
    if files and not (place / TRACE).exists():
        return [read_odometry_csv(path) for path in files]
    return [read_run_odometry(place)]


def _unique(logs: list[OdometrySteps]) -> list[OdometrySteps]:
    """Refuse a log given twice: it would narrow every interval for nothing."""
    for i, log in enumerate(logs):
        for other in logs[:i]:
            if log.claimed.shape == other.claimed.shape and np.array_equal(log.claimed, other.claimed):
                raise InputError(f"calibrate odometry: expected different logs, found '{log.name}' twice")
    return logs


def _held(found: OdometryCalibration, given: WheelOdometryConfig) -> dict[str, object]:
    """What the simulated robot was given, and whether the intervals hold it."""
    out: dict[str, object] = {}
    for name, value in given.model_dump().items():
        estimate = getattr(found, name, None)
        if isinstance(value, float) and estimate is not None:
            out[name] = {"value": value, "recovered": estimate.holds(value)}
    return out


def _arrays(log: LogErrors) -> dict[str, FloatArray]:
    steps = log.steps
    return {
        "t_s": steps.t_s,
        "start": steps.start,
        "truth": steps.truth,
        "claimed": steps.claimed,
        "distance_error_m": log.distance_m,
        "angle_error_rad": log.angle_rad,
    }


def write_calibration(
    out: Path, answer: dict[str, object], data: Mapping[str, FloatArray], texts: Mapping[str, str]
) -> CalibrationResult:
    """Write ``calibrate-<what>-<hash>``; the same data and answer have the same name."""
    return CalibrationResult(*records.write_calibration(out, answer, data, texts))
