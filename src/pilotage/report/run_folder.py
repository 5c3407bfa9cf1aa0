"""Reads a run folder into plain values; what is missing stays empty, what is broken is an InputError.

A run without beacons, plans, ultrasonic sensors or events is a run like any other, so the only files a
run folder must hold are its metrics and its trace.
"""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, Event, FloatArray
from pilotage.report.scan_updates import RecordedUpdate, read_updates
from pilotage.report.sheet_data import SheetData, read_sheet
from pilotage.report.sightings import Sightings, read_sightings

METRICS_FILE = "metrics.json"
TRACE_FILE = "trace.parquet"
MISSION_FILE = "mission.yaml"
EVENTS_FILE = "events.jsonl"
WORLD_FILE = "world.json"
PLANS_FILE = "plans.npz"
UPDATES_FILE = "updates.npz"
SCANS_FILE = "scans.npz"


@dataclass(frozen=True, slots=True)
class Trace:
    """The columns of the trace, one value a step.

    Parameters
    ----------
    columns
        Name to (N,) values; a column that the run did not record is simply not there.
    steps
        N, the number of rows.
    """

    columns: Mapping[str, FloatArray]
    steps: int

    def __getitem__(self, name: str) -> FloatArray:
        """Return the (N,) column, all NaN where the run did not record it."""
        values = self.columns.get(name)
        return np.full(self.steps, np.nan) if values is None else values

    def has(self, *names: str) -> bool:
        """Say whether every named column holds at least one finite value."""
        return all(name in self.columns and bool(np.isfinite(self.columns[name]).any()) for name in names)

    @property
    def t_s(self) -> FloatArray:
        """(N,) times; the row's number where there is no clock."""
        return self["t_s"] if self.has("t_s") else np.arange(self.steps, dtype=np.float64)

    def ultrasonics(self) -> dict[str, FloatArray]:
        """Return the ranges of every ultrasonic sensor by the sensor's name, NaN where saturated."""
        return {
            name.removeprefix("us_").removesuffix("_m"): values
            for name, values in self.columns.items()
            if name.startswith("us_") and name.endswith("_m")
        }


@dataclass(frozen=True, slots=True)
class Landmark:
    """A beacon on the map."""

    id: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class World:
    """What stood in the world: the known map first, then what the robot was not told about."""

    segments_m: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    circles_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    landmarks: tuple[Landmark, ...] = ()
    obstacle_segments_m: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    obstacle_circles_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    obstacle_polygons_m: tuple[FloatArray, ...] = ()
    bounds_m: tuple[float, float, float, float] | None = None
    robot_radius_m: float | None = None
    start: tuple[float, float, float | None] | None = None
    goal: tuple[float, float, float | None] | None = None

    @property
    def has_obstacles(self) -> bool:
        """Whether there was anything that the robot was not told about."""
        unexpected = (self.obstacle_segments_m, self.obstacle_circles_m, self.obstacle_polygons_m)
        return any(len(things) > 0 for things in unexpected)


@dataclass(frozen=True, slots=True)
class Plan:
    """One answer of the planner: the path (N, 3), its waypoints (W, 3) and the search tree (E, 4)."""

    path: FloatArray
    waypoints: FloatArray
    tree: FloatArray
    t_s: float
    length_m: float
    planning_time_s: float


@dataclass(frozen=True, slots=True)
class RunData:
    """Everything a run folder tells."""

    run_dir: Path
    mission: Mapping[str, Any]
    mission_text: str
    metrics: Mapping[str, Any]
    events: tuple[Event, ...]
    world: World
    plans: tuple[Plan, ...]
    mapped_points_m: FloatArray
    shortest_path_m: FloatArray
    trace: Trace
    updates: tuple[RecordedUpdate, ...] = ()
    sightings: Sightings = field(default_factory=Sightings)
    sheet: SheetData | None = None

    @property
    def name(self) -> str:
        """The mission's name, or the folder's."""
        return str(self.metrics.get("mission") or self.mission.get("mission") or self.run_dir.name)

    @property
    def kind(self) -> str:
        """The kind of world that the mission has; "recording" for a recorded log."""
        if not self.mission and "localizer" in self.metrics:
            return "recording"
        world = self.mission.get("world")
        return str(world.get("kind", "floor")) if isinstance(world, Mapping) else "floor"

    @property
    def settle_s(self) -> float:
        """Errors count after this long (the start error is drawn, not earned)."""
        run = self.mission.get("run")
        value = number(run.get("settle_s")) if isinstance(run, Mapping) else math.nan
        return value if math.isfinite(value) else 1.0

    def settled(self) -> BoolArray:
        """(N,) steps that count for the errors; all of them in a run that ended before settling."""
        after = self.trace.t_s > self.settle_s
        return after if bool(after.any()) else np.ones(self.trace.steps, dtype=np.bool_)


def read_run(run_dir: Path) -> RunData:
    """Read a run folder.

    Parameters
    ----------
    run_dir
        Folder written by a run: at least ``metrics.json`` and ``trace.parquet``.

    Raises
    ------
    InputError
        One line, where the folder is not a run folder or one of its files cannot be read.
    """
    if not run_dir.is_dir():
        raise InputError(
            f"{run_dir}: expected a run folder, found {'a file' if run_dir.exists() else 'nothing'}"
        )
    missing = [name for name in (METRICS_FILE, TRACE_FILE) if not (run_dir / name).is_file()]
    if missing:
        raise InputError(f"{run_dir}: not a run folder; expected {' and '.join(missing)} in it")
    mission_text = _text(run_dir / MISSION_FILE)
    plans, mapped_points, shortest_path = _read_plans(run_dir / PLANS_FILE)
    return RunData(
        run_dir=run_dir,
        mission=_read_mission(run_dir / MISSION_FILE, mission_text),
        mission_text=mission_text,
        metrics=_read_object(run_dir / METRICS_FILE),
        events=_read_events(run_dir / EVENTS_FILE),
        world=_read_world(run_dir / WORLD_FILE),
        plans=plans,
        mapped_points_m=mapped_points,
        shortest_path_m=shortest_path,
        trace=_read_trace(run_dir / TRACE_FILE),
        updates=_read_updates(run_dir / UPDATES_FILE),
        sightings=_read_sightings(run_dir / SCANS_FILE),
        sheet=read_sheet(run_dir),
    )


def number(value: object) -> float:
    """Return a float; NaN for None and for what is no number (null stands for NaN in JSON)."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        return math.nan
    return float(value)


def _broken(path: Path, error: Exception) -> InputError:
    return InputError(f"{path}: cannot be read, {str(error) or type(error).__name__}; run the mission again")


def _text(path: Path) -> str:
    """Return a file's text, empty where there is no such file."""
    if not path.is_file():
        return ""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise _broken(path, error) from None


def _read_mission(path: Path, text: str) -> Mapping[str, Any]:
    # The C loader reads a long mission some ten times faster, where libyaml is there.
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        mission = yaml.load(text, Loader=loader)
    except yaml.YAMLError as error:
        raise _broken(path, error) from None
    return mission if isinstance(mission, dict) else {}


def _read_object(path: Path) -> Mapping[str, Any]:
    try:
        content = json.loads(_text(path))
    except ValueError as error:
        raise _broken(path, error) from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected one JSON object, found {type(content).__name__}")
    return content


def _read_events(path: Path) -> tuple[Event, ...]:
    events = []
    for index, line in enumerate(_text(path).splitlines(), start=1):
        if not line.strip():
            continue
        try:
            entry = json.loads(line)
            events.append(Event(number(entry["t_s"]), str(entry["kind"]), str(entry["text"])))
        except (ValueError, KeyError, TypeError, AttributeError):
            raise InputError(
                f"{path}: line {index}: expected an object with t_s, kind and text, found {line[:60]}"
            ) from None
    return tuple(events)


def _read_world(path: Path) -> World:
    if not path.is_file():
        return World()
    content = _read_object(path)
    try:
        bounds = content.get("bounds_m")
        radius = number(content.get("robot_radius_m"))
        return World(
            segments_m=_table(content.get("segments_m"), 4),
            circles_m=_table(content.get("circles_m"), 3),
            landmarks=tuple(
                Landmark(str(entry["id"]), float(entry["x_m"]), float(entry["y_m"]))
                for entry in content.get("landmarks") or ()
            ),
            obstacle_segments_m=_table(content.get("obstacle_segments_m"), 4),
            obstacle_circles_m=_table(content.get("obstacle_circles_m"), 3),
            obstacle_polygons_m=tuple(
                _table(polygon, 2) for polygon in content.get("obstacle_polygons_m") or ()
            ),
            bounds_m=_bounds(bounds),
            robot_radius_m=radius if radius > 0.0 else None,
            start=_pose(content.get("start")),
            goal=_pose(content.get("goal")),
        )
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise _broken(path, error) from None


def _table(rows: object, width: int) -> FloatArray:
    """Return rows of a JSON table as (n, width); empty where there are none."""
    table = np.asarray(rows if rows is not None else [], dtype=np.float64)
    if table.size == 0:
        return np.empty((0, width))
    if table.ndim != 2 or table.shape[1] != width:
        raise ValueError(f"expected rows of {width} numbers, found shape {table.shape}")
    return table


def _bounds(values: object) -> tuple[float, float, float, float] | None:
    if not isinstance(values, list) or len(values) != 4:
        return None
    x_min, y_min, x_max, y_max = (number(value) for value in values)
    proper = math.isfinite(x_min + y_min + x_max + y_max) and x_max > x_min and y_max > y_min
    return (x_min, y_min, x_max, y_max) if proper else None


def _pose(values: object) -> tuple[float, float, float | None] | None:
    if not isinstance(values, list) or len(values) < 2:
        return None
    x, y = number(values[0]), number(values[1])
    theta = number(values[2]) if len(values) > 2 else math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        return None
    return x, y, theta if math.isfinite(theta) else None


def _read_plans(path: Path) -> tuple[tuple[Plan, ...], FloatArray, FloatArray]:
    """Return the plans in their order, the obstacle points the robot mapped and the shortest path."""
    if not path.is_file():
        return (), np.empty((0, 2)), np.empty((0, 2))
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in archive.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise _broken(path, error) from None

    def rows(name: str, width: int) -> FloatArray:
        array = arrays.get(name)
        return (
            array
            if array is not None and array.ndim == 2 and array.shape[1] >= width
            else np.empty((0, width))
        )

    def scalar(name: str) -> float:
        array = arrays.get(name)
        return float(array.reshape(-1)[0]) if array is not None and array.size else math.nan

    plans: list[Plan] = []
    while f"path_{len(plans)}" in arrays:
        i = len(plans)
        plans.append(
            Plan(
                path=rows(f"path_{i}", 2),
                waypoints=rows(f"waypoints_{i}", 2),
                tree=rows(f"tree_{i}", 4),
                t_s=scalar(f"t_{i}"),
                length_m=scalar(f"length_{i}"),
                planning_time_s=scalar(f"planning_time_{i}"),
            )
        )
    return tuple(plans), rows("mapped_points", 2), rows("shortest_path", 2)


def _read_sightings(path: Path) -> Sightings:
    if not path.is_file():
        return Sightings()
    try:
        return read_sightings(path)
    except (OSError, ValueError, EOFError, KeyError, IndexError, zipfile.BadZipFile) as error:
        raise _broken(path, error) from None


def _read_updates(path: Path) -> tuple[RecordedUpdate, ...]:
    if not path.is_file():
        return ()
    try:
        return read_updates(path)
    except (OSError, ValueError, EOFError, KeyError, IndexError, zipfile.BadZipFile) as error:
        raise _broken(path, error) from None


def _read_trace(path: Path) -> Trace:
    # Imported here: a report needs it, the summary in the terminal does not.
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        # One file of a few hundred kilobytes: starting a pool of threads costs more than it gains.
        table = pq.ParquetFile(path).read(use_threads=False)
    except (OSError, pa.ArrowException) as error:
        raise _broken(path, error) from None
    columns = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        # A column of words (a sensor's state, say) is no series that could be drawn.
        if pa.types.is_floating(column.type) or pa.types.is_integer(column.type):
            columns[name] = np.asarray(column.to_numpy(), dtype=np.float64)
    return Trace(_without_lost_poses(columns), table.num_rows)


def _without_lost_poses(columns: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Leave out what a lost robot's belief holds in place of a pose: it claims none, so none is drawn."""
    localized = columns.get("localized")
    if localized is None or not bool((localized < 0.5).any()):
        return columns
    return {
        name: np.where(localized < 0.5, np.nan, values)
        if name.startswith(("est_", "cov_", "nees"))
        else values
        for name, values in columns.items()
    }
