"""Recordings: localized, mapped, calibrated from, judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from pilotage.core import given
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.types import FloatArray, Pose2
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
    map: FilePath | None = None,  # noqa: A002 - the word for it
    landmarks: FilePath | None = None,
    start: Sequence[float] | FloatArray | None = None,
    topics: Sequence[str] = (),
    truth: FilePath | None = None,
    from_s: float = 0.0,
    to_s: float = math.inf,
    format: Literal["bag", "mrclam", "aer1513", "stops"] | None = None,  # noqa: A002 - as the command line calls it
    robot: int | None = None,
    localizer: str | None = None,
    max_range_m: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
    out: FilePath = "runs",
) -> Run:
    """Run a localizer over a recording, and judge it where the truth is known.

    Parameters
    ----------
    log
        A ROS 1 or 2 bag, an MCAP file or a CARMEN log; a MRCLAM folder, an AER1513 MATLAB file, or a CSV of a
        rover's stops (dead reckoning, each stretch by what the others taught).
    map, landmarks
        bag: what to localize in: a shipped map's name or a map file, for scans; a table id, x_m, y_m.
    start
        bag: x, y, theta at the first reading; None: where the truth says.
    topics
        bag: scans, odometry, velocities, gyroscope or landmarks by name, where the usual ones are not meant.
    truth
        bag: true poses in the map: a topic, ``/tf:PARENT:CHILD``, or a TUM file. Without any the run is
        judged by what the localizer holds of itself.
    from_s, to_s
        bag: the part that counts, in seconds after its first reading.
    format
        None: as it looks.
    robot
        mrclam: which of its robots, 1 to 5.
    localizer
        A registered localizer; None: ``particle-filter`` on scans, ``ekf-landmarks`` on a bag's landmarks,
        else ``ekf-gauss-markov``.
    max_range_m
        aer1513: readings beyond are left out.
    set
        The localizer's parameters by dotted key, ``stack.localizer.gate`` and the like.

    Returns
    -------
    Run
        With the same metrics, trace and report as a simulated one; ``trajectory.tum`` in its folder is the
        path by the recording's clock, as long as the localizer held itself for localized.

    Raises
    ------
    InputError
        Where the recording is not what it should be; of a bag without what is needed the message tells what
        it holds.
    """
    from pilotage.experiments.recordings.localize import FORMATS, Setting, localize_log

    if format is not None and given.word("format", format) not in FORMATS:
        raise unknown_name("format", format, FORMATS)
    setting = Setting(
        None if map is None else str(given.path("map", map)),
        None if landmarks is None else given.path("landmarks", landmarks),
        None if start is None else Pose2.from_array(given.array("start", start, 3)),
        given.words("topics", topics),
        None if truth is None else str(given.path("truth", truth)),
        given.number("from_s", from_s),
        given.number("to_s", to_s, high=math.inf),
    )
    result = localize_log(
        given.path("log", log),
        given.folder("out", out),
        form=format,
        robot=None if robot is None else given.whole("robot", robot),
        localizer=None if localizer is None else given.word("localizer", localizer),
        overrides=given.overrides("set", set),
        max_range_m=None if max_range_m is None else given.number("max_range_m", max_range_m, above=0.0),
        setting=setting,
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
    extend: FilePath | None = None,
    out: FilePath = "runs",
) -> MappedLog:
    """Map a recording of a building that nobody has mapped.

    Parameters
    ----------
    log
        A ROS bag, an MCAP file or a CARMEN log with scans and odometry, or the folder of a run with a LiDAR.
    config
        A YAML file of the few parameters; None: as shipped.
    topics
        A bag's scans and odometry by name, where the usual ones are not meant.
    extend
        Folder of an earlier ``slam``: the recording, which may begin anywhere, is joined to its map.

    Raises
    ------
    InputError
        What of the log or of the earlier folder cannot be used, or why nothing joins the two.
    """
    from pilotage.experiments.slam import read_slam_config, slam_log

    settings = read_slam_config(None if config is None else given.path("config", config))
    earlier = None if extend is None else given.path("extend", extend)
    recording, asked = given.path("log", log), given.words("topics", topics)
    run = slam_log(recording, given.folder("out", out), settings, topics=asked, extend=earlier)
    if run.run_dir is None:
        raise InputError(f"{log}: {run.metrics['reason']}")
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
    topics: Sequence[str] = (),
    truth: str | None = None,
    landmarks: FilePath | None = None,
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
    topics, truth
        Of bags: what is calibrated, where the usual one is not meant; odometry, heading, commands: the topic
        of the truth.
    landmarks
        commands, of bags: a CSV table id, x_m, y_m, by which the camera is calibrated too.

    Raises
    ------
    InputError
        Where a log is not what it should be.
    """
    from pilotage.experiments import calibrate as lab

    if given.word("what", what) not in KINDS:
        raise unknown_name("calibration", what, KINDS)
    listed = logs if isinstance(logs, list | tuple) else [logs]
    places, target = [given.path("logs", log) for log in listed], given.folder("out", out)
    set, topics, seed = given.words("set", set), given.words("topics", topics), given.whole("seed", seed)  # noqa: A001
    if truth is not None:
        given.word("truth", truth)
    if what == "odometry":
        result = lab.odometry_from(
            places,
            target,
            overrides=set,
            seed=seed,
            wheel_base_m=None
            if wheel_base_m is None
            else given.number("--wheel-base", wheel_base_m, above=0.0),
            sensor=given.word("sensor", sensor),
            topics=topics,
            truth=truth,
        )
    elif what == "range":
        result = lab.range_from(places, target, overrides=set, seed=seed, topics=topics)
    elif what == "heading":
        result = lab.heading_from(places, target, axis=given.word("axis", axis), topics=topics, truth=truth)
    else:
        from pilotage.experiments.calibrate_commands import commands_from

        result = commands_from(
            places,
            target,
            robots=given.indices("robots", robots, None).tolist(),
            leave_one_out=given.flag("leave_one_out", leave_one_out),
            topics=topics,
            truth=truth,
            landmarks=None if landmarks is None else given.path("landmarks", landmarks),
        )
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
    topics: Sequence[str] = (),
) -> Evaluation:
    """Say how far an estimated trajectory is from its reference: absolute and relative errors.

    Parameters
    ----------
    estimate, reference
        Files of one format, bags, or arrays: (N, 3) x, y, theta of the same moments, or (N, 4) with times
        first.
    format
        Of the files, ``tum`` or ``kitti``; None: told by their columns.
    align, scale
        Rotate and shift the estimate first; correct its scale first.
    topics
        Of bags: the poses of each one in turn (``/tf:PARENT:CHILD`` for transforms), where the usual are not
        meant. A bag may be judged against another file with times, or against itself by two topics.

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
    align, scale = given.flag("align", align), given.flag("scale", scale)
    topics, told = given.words("topics", topics), _told_format(format)
    files = isinstance(estimate, str | PathLike), isinstance(reference, str | PathLike)
    if not all(files):
        if any(files):
            raise InputError("evaluate: expected two files or two arrays, found one of each")
        found, true = _of_array("estimate", estimate), _of_array("reference", reference)
        return Evaluation(trajectory_errors(found, true, align=align, scale=scale), "arrays")
    paths = given.path("estimate", estimate), given.path("reference", reference)
    form = told or _format_by_columns(paths[0], paths[1])
    found, true = _read_both(paths, form, topics)
    if found.t_s is None and len(found) != len(true):
        short, full = paths if len(found) < len(true) else paths[::-1]
        raise InputError(
            f"{short}: without times expected as many poses as in {full} ({max(len(found), len(true))}), "
            f"found {min(len(found), len(true))}; is the file cut short?"
        )
    return Evaluation(trajectory_errors(found, true, align=align, scale=scale), str(form))


def _format_by_columns(estimate: Path, reference: Path) -> TrajectoryFormat:
    """The format of both files.

    Raises
    ------
    InputError
        Where the two differ by their columns.
    """
    formats = [
        TrajectoryFormat.TUM if _is_bag(path) else guess_format(path) for path in (estimate, reference)
    ]
    if formats[0] is not formats[1]:
        raise InputError(
            "evaluate: expected both files in one format, found by their columns "
            f"{estimate} as {formats[0]} and {reference} as {formats[1]}"
        )
    return formats[0]


def _told_format(told: str | None) -> TrajectoryFormat | None:
    names = [str(name) for name in TrajectoryFormat]
    if told is not None and given.word("--format", told) not in names:
        raise unknown_name("--format", told, names)
    return None if told is None else TrajectoryFormat(told)


def _is_bag(path: Path) -> bool:
    from pilotage.logs.bag_messages import is_bag

    return path.exists() and is_bag(path)


def _read_both(
    paths: tuple[Path, Path], form: TrajectoryFormat, topics: Sequence[str]
) -> tuple[Trajectory3, Trajectory3]:
    """Files of a format, or topics of bags: each bag takes the next one."""
    from pilotage.logs.bag_series import trajectory_of_bag

    bags = [path for path in paths if _is_bag(path)]
    if len(topics) > len(bags):
        raise InputError(f"evaluate: expected a topic for each bag, found {len(topics)} for {len(bags)}")
    if bags and form is not TrajectoryFormat.TUM:
        raise InputError("evaluate: expected files with times beside a bag, found --format kitti")
    if len(bags) == 2 and bags[0] == bags[1] and len(topics) < 2:
        raise InputError(f"{bags[0]}: expected two topics of the one bag, found {len(topics)}")
    left = iter(topics)
    first, second = (
        trajectory_of_bag(path, next(left, None)) if path in bags else read_trajectory(path, form)
        for path in paths
    )
    return first, second


def _of_array(name: str, values: Any) -> Trajectory3:
    """Planar poses as a path in space."""
    poses = given.array(name, values, None, None)
    if poses.shape[1] not in (3, 4):
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
