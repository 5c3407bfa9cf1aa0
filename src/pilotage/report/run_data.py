"""A recorded run as plain values: what every figure, table and replay is made from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import BoolArray, Event, FloatArray
from pilotage.report.scan_updates import RecordedUpdate
from pilotage.report.sheet_data import SheetData
from pilotage.report.sightings import Sightings


def number(value: object) -> float:
    """Return a float; NaN for None and for what is no number (null stands for NaN in JSON)."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        return math.nan
    return float(value)


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
