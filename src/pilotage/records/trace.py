"""``trace.parquet``: one row a step, or a step and robot; columns by name, float64."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.parquet import arrow_table, parquet_metadata, read_parquet
from pilotage.core.json_text import load_json
from pilotage.core.limits import MB
from pilotage.core.misfit import LARGEST
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.reading import clean_text, is_there

TRACE_FILE = "trace.parquet"
ROBOT_COLUMN = "robot"
ROBOTS_KEY = "pilotage.robots"
"""Key of the file's metadata: the robots' names as a JSON list, in the order of their numbers."""
TRACE_BYTES = 256 * MB
"""Unpacked: twelve hours of ten steps a second in seventy columns."""
MOST_ROBOTS = 10_000


@dataclass(frozen=True, slots=True)
class Trace:
    """The columns of the trace, one value a step and robot.

    Parameters
    ----------
    columns
        Name to (N,) values; a column that the run did not record is simply not there.
    steps
        N, the number of rows.
    robots, robot
        The robots' names, and (N,) whose row it is as an index into them; none and None where there is one
        robot only.
    """

    columns: Mapping[str, FloatArray]
    steps: int
    robots: tuple[str, ...] = ()
    robot: IntArray | None = None

    def __getitem__(self, name: str) -> FloatArray:
        """Return the (N,) column, all NaN where the run did not record it."""
        values = self.columns.get(name)
        return np.full(self.steps, np.nan) if values is None else values

    def has(self, *names: str) -> bool:
        """Say whether every named column holds at least one finite value."""
        return all(name in self.columns and bool(np.isfinite(self.columns[name]).any()) for name in names)

    @property
    def t_s(self) -> FloatArray:
        """(N,) times; the row's number where there is no clock, or it does not go forward."""
        times = self["t_s"]
        forward = bool(np.isfinite(times).all()) and (
            self.steps < 2
            or (bool((np.diff(times) >= 0.0).all()) and times[-1] - times[0] > 1e-9 * np.abs(times).max())
        )
        return times if forward else np.arange(self.steps, dtype=np.float64)

    def of(self, robot: int) -> Trace:
        """Return the rows of one robot only, in their order."""
        if self.robot is None:
            return self
        rows = np.flatnonzero(self.robot == robot)
        return Trace({name: values[rows] for name, values in self.columns.items()}, len(rows))

    def ultrasonics(self) -> dict[str, FloatArray]:
        """Return the ranges of every ultrasonic sensor by the sensor's name, NaN where saturated."""
        return {
            name.removeprefix("us_").removesuffix("_m"): values
            for name, values in self.columns.items()
            if name.startswith("us_") and name.endswith("_m")
        }


def trace_of(columns: Mapping[str, FloatArray]) -> Trace:
    """The trace of one robot, from its columns."""
    return Trace(columns, len(next(iter(columns.values()))) if columns else 0)


def merged(traces: Mapping[str, Mapping[str, FloatArray]]) -> Trace:
    """The trace of several robots, from each one's columns by its name.

    Rows of the same time stand together, robots in their order; what a robot did not record is NaN.
    """
    lengths = [len(next(iter(columns.values()))) if columns else 0 for columns in traces.values()]
    robot = np.repeat(np.arange(len(traces), dtype=np.int64), lengths)
    names = list(dict.fromkeys(name for columns in traces.values() for name in columns))
    joined = {
        name: np.concatenate(
            [
                columns.get(name, np.full(n, np.nan))
                for columns, n in zip(traces.values(), lengths, strict=True)
            ]
            or [np.empty(0)]
        )
        for name in names
    }
    order = np.lexsort((robot, joined["t_s"])) if "t_s" in joined else np.arange(len(robot))
    columns = {name: np.ascontiguousarray(values[order]) for name, values in joined.items()}
    return Trace(columns, len(robot), tuple(traces), robot[order])


def write_trace(folder: Path, trace: Trace) -> None:
    """Write the trace; with several robots also the column ``robot`` and their names in the metadata."""
    import pyarrow.parquet as pq

    columns: dict[str, Any] = dict(trace.columns)
    metadata = None
    if trace.robot is not None:
        columns = {ROBOT_COLUMN: trace.robot.astype(np.int32), **columns}
        metadata = {ROBOTS_KEY: json.dumps(list(trace.robots))}
    with (folder / TRACE_FILE).open("wb") as file:  # Arrow takes no name whose bytes are no UTF-8
        pq.write_table(arrow_table(columns, metadata), file)


def read_trace(folder: Path, columns: Sequence[str] | None = None) -> Trace:
    """Read the trace.

    Parameters
    ----------
    columns
        Only these; None reads every column of numbers. A column of words (a sensor's state, say) is no
        series and left out; a value beyond ``numbers.LARGEST`` is NaN, as nothing measured is that large.

    Raises
    ------
    InputError
        One line, where the file is missing, is no Parquet file, lacks a column, or is larger than any run's.
    """
    path = folder / TRACE_FILE
    if not is_there(path):
        raise InputError(f"{path}: expected a run folder's trace, found none there")
    stored = read_parquet(path, columns, "a run's trace", TRACE_BYTES)
    rows = len(next(iter(stored.values()))) if stored else 0
    found = {name: _numbers(values) for name, values in stored.items() if values.dtype.kind in "fiu"}
    robots, robot = _robots(path, found.pop(ROBOT_COLUMN, None))
    return Trace({clean_text(name): values for name, values in found.items()}, rows, robots, robot)


def _numbers(values: Any) -> FloatArray:
    """A column as (N,) float64."""
    out = np.asarray(values, dtype=np.float64)
    # Infinities are left: a clearance is infinite where there is nothing.
    huge = np.isfinite(out) & (np.abs(out) > LARGEST)
    return np.where(huge, np.nan, out) if bool(huge.any()) else out


def _robots(path: Path, robot: FloatArray | None) -> tuple[tuple[str, ...], IntArray | None]:
    """The robots' names and whose row it is."""
    if robot is None:
        return (), None
    if not bool(((robot >= 0.0) & (robot < MOST_ROBOTS)).all()):
        raise InputError(f"{path}: robot: expected whole numbers from 0 to {MOST_ROBOTS - 1}")
    whose = robot.astype(np.int64)
    count = int(whose.max()) + 1 if whose.size else 0
    names = parquet_metadata(path).get(ROBOTS_KEY, "[]")
    told = load_json(names, f"{path}: {ROBOTS_KEY}")
    named = [clean_text(str(name)) for name in told[:MOST_ROBOTS]] if isinstance(told, list) else []
    return (*named, *(f"robot {k}" for k in range(len(named), count))), whose
