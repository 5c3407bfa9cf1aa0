"""Reads a run folder into plain values; what is missing stays empty, what is broken is an InputError.

A run without beacons, plans, ultrasonic sensors or events is a run like any other, so the only files a
run folder must hold are its metrics and its trace.
"""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml

from pilotage.core.errors import InputError
from pilotage.core.types import Event, FloatArray
from pilotage.report.run_data import Landmark, Plan, RunData, Trace, World, number
from pilotage.report.scan_updates import read_updates
from pilotage.report.sheet_data import read_sheet
from pilotage.report.sightings import Sightings, read_sightings

T = TypeVar("T")

METRICS_FILE = "metrics.json"
TRACE_FILE = "trace.parquet"
MISSION_FILE = "mission.yaml"
EVENTS_FILE = "events.jsonl"
WORLD_FILE = "world.json"
PLANS_FILE = "plans.npz"
UPDATES_FILE = "updates.npz"
SCANS_FILE = "scans.npz"


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
        updates=_archive(run_dir / UPDATES_FILE, read_updates, ()),
        sightings=_archive(run_dir / SCANS_FILE, read_sightings, Sightings()),
        sheet=read_sheet(run_dir),
    )


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


def _archive(path: Path, read: Callable[[Path], T], empty: T) -> T:
    """Read an archive of arrays, or hand out ``empty`` where the run has none."""
    if not path.is_file():
        return empty
    try:
        return read(path)
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
