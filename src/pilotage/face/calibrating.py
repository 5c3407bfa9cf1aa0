"""Recordings that parameters are calibrated from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pilotage.core import given
from pilotage.core.errors import unknown_name
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible

Kind: TypeAlias = Literal["odometry", "range", "heading", "commands"]
KINDS = ("odometry", "range", "heading", "commands")


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


@interruptible()
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
    truth: FilePath | None = None,
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
        Of bags: what is calibrated, where the usual one is not meant; odometry, heading, commands: the true
        poses, a topic, ``/tf:PARENT:CHILD`` or a TUM file.
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
    true = None if truth is None else str(given.path("truth", truth))
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
            truth=true,
        )
    elif what == "range":
        result = lab.range_from(places, target, overrides=set, seed=seed, topics=topics)
    elif what == "heading":
        result = lab.heading_from(places, target, axis=given.word("axis", axis), topics=topics, truth=true)
    else:
        from pilotage.experiments.calibrate_commands import commands_from

        result = commands_from(
            places,
            target,
            robots=given.indices("robots", robots, None).tolist(),
            leave_one_out=given.flag("leave_one_out", leave_one_out),
            topics=topics,
            truth=true,
            landmarks=None if landmarks is None else given.path("landmarks", landmarks),
        )
    return Calibration(result.answer, result.folder)
