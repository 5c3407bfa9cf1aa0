"""Recordings: localized, mapped, calibrated from, judged; and a robot tracked on film."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from pilotage.core.errors import InputError, unknown_name
from pilotage.core.types import FloatArray
from pilotage.evaluation.trajectory import TrajectoryErrors, trajectory_errors
from pilotage.face.metrics import Metrics
from pilotage.face.runs import Run
from pilotage.logs.trajectories import Trajectory3, TrajectoryFormat, guess_format, read_trajectory

FilePath: TypeAlias = "str | PathLike[str]"
Kind: TypeAlias = Literal["odometry", "range", "heading", "commands"]
KINDS = ("odometry", "range", "heading", "commands")


def localize(
    log: FilePath,
    *,
    format: Literal["mrclam", "aer1513", "stops"],  # noqa: A002 - as the command line calls it
    robot: int | None = None,
    localizer: str = "ekf-gauss-markov",
    max_range_m: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
    out: FilePath = "runs",
) -> Run:
    """Run a localizer over a recording with truth, and judge it.

    Parameters
    ----------
    log
        A MRCLAM folder, an AER1513 MATLAB file, or a CSV of a rover's stops (dead reckoning, each stretch
        by what the others taught).
    robot
        mrclam: which of its robots, 1 to 5.
    localizer
        A registered localizer that knows its landmarks.
    max_range_m
        aer1513: readings beyond are left out.
    set
        The localizer's parameters by dotted key, ``stack.localizer.gate`` and the like.

    Returns
    -------
    Run
        With the same metrics, trace and report as a simulated one.

    Raises
    ------
    InputError
        Where the recording is not what it should be.
    """
    from pilotage.experiments.recordings.localize import FORMATS, localize_log

    if format not in FORMATS:
        raise unknown_name("format", format, FORMATS)
    overrides = [f"{key}={json.dumps(value)}" for key, value in (set or {}).items()]
    result = localize_log(
        Path(log),
        Path(out),
        form=format,
        robot=robot,
        localizer=localizer,
        overrides=overrides,
        max_range_m=max_range_m,
    )
    return Run(result.run_dir)


@dataclass(frozen=True, slots=True, eq=False)
class MappedLog:
    """What SLAM made of a recording.

    Attributes
    ----------
    folder
        Map (a ROS map), trajectory (TUM), pose graph (g2o), covariances, closures.
    metrics
        Numbers by key.
    trajectory
        Times and poses of the scans.
    warnings
        What one should know.
    """

    folder: Path
    metrics: Metrics
    trajectory: Trajectory3 = field(repr=False)
    warnings: tuple[str, ...]

    @property
    def map(self) -> Path:
        """The map as a ROS map's YAML file, to plan and to drive on."""
        return self.folder / "map.yaml"

    def report(self) -> Path:
        """Write its page and return the path."""
        from pilotage.report.slam.page import write_slam_report

        return write_slam_report(self.folder)


def slam(
    log: FilePath,
    *,
    config: FilePath | None = None,
    topics: Sequence[str] = (),
    out: FilePath = "runs",
) -> MappedLog:
    """Map a recording of a building that nobody has mapped.

    Parameters
    ----------
    log
        A ROS bag, an MCAP file or a CARMEN log with scans and odometry.
    config
        A YAML file of the few parameters; None: as shipped.
    topics
        A bag's scans and odometry by name, where the usual ones are not meant.

    Raises
    ------
    InputError
        What of the log cannot be used.
    """
    from pilotage.experiments.slam import read_slam_config, slam_log

    settings = read_slam_config(None if config is None else Path(config))
    run = slam_log(Path(log), Path(out), settings, topics=topics)
    trajectory = read_trajectory(run.run_dir / "trajectory.tum", TrajectoryFormat.TUM)
    return MappedLog(run.run_dir, Metrics(run.metrics), trajectory, run.warnings)


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Noise and systematic errors, each with its 95 % interval.

    Attributes
    ----------
    answer
        By key; an estimate is a mapping with value, low and high.
    folder
        Where it is with its data and its parameter file.
    """

    answer: Mapping[str, Any]
    folder: Path

    def __getitem__(self, key: str) -> Any:
        """One estimate or warning by its key."""
        if key not in self.answer:
            raise unknown_name("estimate", key, self.answer)
        return self.answer[key]

    @property
    def parameter_file(self) -> Path | None:
        """A YAML file to lay over a mission (``--set @FILE``); None where there is none."""
        from pilotage.records.calibration import PARAMETER_FILE

        path = self.folder / PARAMETER_FILE
        return path if path.is_file() else None

    def report(self) -> Path:
        """Write its page and return the path."""
        from pilotage.report import write_report

        return write_report(self.folder)


def calibrate(
    what: Kind,
    logs: Sequence[FilePath] | FilePath = (),
    *,
    set: Sequence[str] = (),  # noqa: A002 - as the command line calls it
    seed: int = 0,
    sensor: str = "odometry",
    wheel_base_m: float | None = None,
    axis: Literal["x", "y", "z"] = "z",
    robots: Sequence[int] = (),
    leave_one_out: bool = False,
    out: FilePath = "runs",
) -> Calibration:
    """Estimate a sensor's or a drive's noise and systematic errors.

    Parameters
    ----------
    what
        ``odometry``, ``range``, ``heading`` (gyroscopes, magnetometers) or ``commands`` (a drive).
    logs
        Recordings; without any, runs are simulated (odometry, range).
    set, seed
        Of simulated runs, as the command line has them.
    sensor, wheel_base_m
        odometry: the sensor's name in the mission, and the wheel base that it was told.
    axis
        heading: the axis that the robot turns about.
    robots, leave_one_out
        commands: from these robots of the recordings only; a set without each recording in turn besides.

    Raises
    ------
    InputError
        Where a log is not what it should be.
    """
    from pilotage.experiments import calibrate as lab

    if what not in KINDS:
        raise unknown_name("calibration", what, KINDS)
    single = isinstance(logs, str | PathLike)
    places = [Path(logs)] if single else [Path(log) for log in logs]  # type: ignore[arg-type,union-attr]
    target = Path(out)
    if what == "odometry":
        result = lab.odometry_from(
            places, target, overrides=set, seed=seed, wheel_base_m=wheel_base_m, sensor=sensor
        )
    elif what == "range":
        result = lab.range_from(places, target, overrides=set, seed=seed)
    elif what == "heading":
        result = lab.heading_from(places, target, axis=axis)
    else:
        from pilotage.experiments.calibrate_commands import commands_from

        result = commands_from(places, target, robots=robots, leave_one_out=leave_one_out)
    return Calibration(result.answer, result.folder)


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation(Mapping[str, float]):
    """How far an estimated trajectory is from its reference: ``evaluation["ate_rmse_m"]``.

    Attributes
    ----------
    errors
        Of every pose and of every step, and the alignment.
    format
        ``tum``, ``kitti`` or ``arrays``.
    """

    errors: TrajectoryErrors
    format: str

    def __getitem__(self, key: str) -> float:
        return self.errors.summary()[key]

    def __iter__(self) -> Any:
        return iter(self.errors.summary())

    def __len__(self) -> int:
        return len(self.errors.summary())

    def __repr__(self) -> str:
        told = ", ".join(f"{key}={value:.4g}" for key, value in self.items())
        return f"Evaluation({told})"


def evaluate(
    estimate: FilePath | FloatArray,
    reference: FilePath | FloatArray,
    *,
    format: str | None = None,  # noqa: A002 - as the command line calls it
    align: bool = False,
    scale: bool = False,
) -> Evaluation:
    """Say how far an estimated trajectory is from its reference: absolute and relative errors.

    Parameters
    ----------
    estimate, reference
        Files of one format, or arrays: (N, 3) x, y, theta of the same moments, or (N, 4) with times first.
    format
        Of the files, ``tum`` or ``kitti``; None: told by their columns.
    align, scale
        Rotate and shift the estimate first; correct its scale first.

    Raises
    ------
    InputError
        Where the two have too few moments in common, or a file is not what it should be.

    Examples
    --------
    >>> import numpy as np, pilotage as pl
    >>> truth = np.column_stack([np.linspace(0.0, 5.0, 51), np.zeros(51), np.zeros(51)])
    >>> found = pl.evaluate(truth + [0.03, 0.04, 0.0], truth)
    >>> round(found["ate_rmse_m"], 6), round(found["rpe_rmse_m"], 6)
    (0.05, 0.0)
    """
    given = isinstance(estimate, np.ndarray), isinstance(reference, np.ndarray)
    if any(given):
        if not all(given):
            raise InputError("evaluate: expected two files or two arrays, found one of each")
        found, true = _of_array("estimate", estimate), _of_array("reference", reference)
        return Evaluation(trajectory_errors(found, true, align=align, scale=scale), "arrays")
    paths = Path(str(estimate)), Path(str(reference))
    form = judged_format(paths[0], paths[1], format)
    found, true = (read_trajectory(path, form) for path in paths)
    if found.t_s is None and len(found) != len(true):
        short, full = paths if len(found) < len(true) else paths[::-1]
        raise InputError(
            f"{short}: without times expected as many poses as in {full} ({max(len(found), len(true))}), "
            f"found {min(len(found), len(true))}; is the file cut short?"
        )
    return Evaluation(trajectory_errors(found, true, align=align, scale=scale), str(form))


def judged_format(estimate: Path, reference: Path, told: str | None) -> TrajectoryFormat:
    """The format of both files.

    Raises
    ------
    InputError
        Where there is no such format, or the two differ by their columns.
    """
    names = [str(name) for name in TrajectoryFormat]
    if told is not None:
        if told not in names:
            raise unknown_name("--format", told, names)
        return TrajectoryFormat(told)
    formats = [guess_format(path) for path in (estimate, reference)]
    if formats[0] is not formats[1]:
        raise InputError(
            "evaluate: expected both files in one format, found by their columns "
            f"{estimate} as {formats[0]} and {reference} as {formats[1]}"
        )
    return formats[0]


def _of_array(name: str, values: Any) -> Trajectory3:
    """Planar poses as a path in space."""
    poses = np.asarray(values, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] not in (3, 4) or not np.isfinite(poses).all():
        raise InputError(
            f"{name}: expected finite poses (N, 3) x, y, theta or (N, 4) t, x, y, theta, found {poses.shape}"
        )
    t_s = poses[:, 0].copy() if poses.shape[1] == 4 else None
    if t_s is not None and not (np.diff(t_s) > 0.0).all():
        raise InputError(f"{name}: expected times that grow, found one that does not")
    x, y, theta = poses[:, -3], poses[:, -2], poses[:, -1]
    c, s, zero, one = np.cos(theta), np.sin(theta), np.zeros(len(poses)), np.ones(len(poses))
    turns = np.stack([c, -s, zero, s, c, zero, zero, zero, one], axis=1).reshape(-1, 3, 3)
    return Trajectory3(t_s, np.column_stack([x, y, zero]), turns)


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A robot's path on a square map, from a film.

    Attributes
    ----------
    answer
        Everything, by its JSON key: corners, grid, visited cells, path.
    path
        (N, 3) time in s, x and y in m.
    written
        Files that were written.
    """

    answer: Mapping[str, Any] = field(repr=False)
    path: FloatArray
    written: tuple[Path, ...] = ()

    @property
    def visited_cells(self) -> int:
        """How many cells the robot's centre was in."""
        return int(self.answer["visited_count"])


def track(
    video: FilePath,
    *,
    corners: str | None = None,
    hsv: str | None = None,
    grid: int = 25,
    size_m: float = 1.8,
    radius_m: float | None = None,
    height_m: float = 0.0,
    out: FilePath | None = None,
) -> Tracked:
    """Track a robot on a square map through a film; needs the extra ``vision``.

    Parameters
    ----------
    video
        A film by a fixed camera that sees the map.
    corners
        The map's corners in pixels, ``X,Y,X,Y,X,Y,X,Y`` from its origin counter-clockwise; None: found.
    hsv
        The robot's colour, ``H0,S0,V0,H1,S1,V1``; None: learned.
    grid, size_m
        Cells along a side, and the side's length.
    radius_m, height_m
        Of the robot's coloured disc: its radius (None: learned) and how high it is over the floor.
    out
        Folder for JSON, CSV, the map's picture and text maps; None: nothing is written.

    Raises
    ------
    InputError
        Where the file is no film, or no map is in it.
    """
    from pilotage.tracking.output import write_track
    from pilotage.tracking.robot_colour import parse_hsv
    from pilotage.tracking.scene import TrackOptions, learn_scene
    from pilotage.tracking.sheet import parse_corners
    from pilotage.tracking.track import follow

    options = TrackOptions(
        None if corners is None else parse_corners(corners),
        None if hsv is None else parse_hsv(hsv),
        grid,
        size_m,
        radius_m,
        height_m,
    )
    film = Path(video)
    found = follow(film, learn_scene(film, options))
    written: tuple[Path, ...] = ()
    if out is not None:
        folder = Path(out)
        folder.mkdir(parents=True, exist_ok=True)
        written = tuple(write_track(folder, found))
    answer = found.as_dict()
    rows = [(entry["t_s"], entry["x_m"], entry["y_m"]) for entry in answer["path"]]
    return Tracked(answer, np.array(rows, dtype=np.float64).reshape(-1, 3), written)
