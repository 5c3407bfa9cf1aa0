"""A run folder read: what every figure, table and replay is made from."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, TypeVar

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, Event, FloatArray
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.records.cells import SheetData, read_cells
from pilotage.records.events import read_events
from pilotage.records.folder import check_folder
from pilotage.records.grid import read_grid_layer, read_own_map
from pilotage.records.localizer import read_localizer
from pilotage.records.metrics import METRICS_FILE, read_metrics
from pilotage.records.mission import read_mission
from pilotage.records.numbers import number
from pilotage.records.patrol import PatrolRecord, read_patrol
from pilotage.records.people import PeopleTracks, read_people_tracks
from pilotage.records.plans import Plan, Plans, read_plans
from pilotage.records.run_folder import robot_folder
from pilotage.records.scans import Sightings, read_sightings
from pilotage.records.terrain import TerrainPictures, read_terrain
from pilotage.records.trace import TRACE_FILE, Trace, read_trace
from pilotage.records.updates import RecordedUpdate, read_updates
from pilotage.records.world import RobotOutline, World, read_world

T = TypeVar("T")
PLACES = ("_x_m", "_y_m")
"""How the names of columns end that hold places on the map."""
LEAST = 1e-100
"""What is smaller is nothing: quotients of such values are no numbers."""


@dataclass(frozen=True, slots=True)
class RunData:
    """Everything a run folder tells, of one of its robots.

    Attributes
    ----------
    trace
        That robot's rows, finite or NaN; a lost robot claims no pose, so none is in ``est_*``, ``cov_*`` and
        ``nees``.
    grid, own_map
        The world's grid, and the map that the robot made; None where there is none.
    robot, robots
        Which robot it is, and the names of all; none where the run has one only.
    """

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
    terrain: TerrainPictures | None = None
    grid: OccupancyGrid | None = None
    own_map: OccupancyGrid | None = None
    people: PeopleTracks = field(default_factory=PeopleTracks)
    patrol: PatrolRecord | None = None
    localizer_text: str = ""
    robot: int = 0
    robots: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The mission's name, or the folder's."""
        return str(self.metrics.get("mission") or self.mission.get("mission") or self.run_dir.name)

    @property
    def recorded(self) -> bool:
        """Whether it replays a recorded log instead of a simulation."""
        return not self.mission and ("localizer" in self.metrics or bool(self.localizer_text))

    @property
    def outline(self) -> RobotOutline:
        """The robot as it is drawn."""
        known = self.world.robots
        return known[self.robot] if self.robot < len(known) else RobotOutline()

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


def read_team(folder: Path, first: RunData, on_damage: OnDamage | None = None) -> tuple[RunData, ...]:
    """All robots' views of a run, ``first`` among them; one alone where there is one robot."""
    if len(first.robots) <= 1:
        return (first,)
    trace = read_trace(folder)
    return first, *(
        replace(first, robot=k, **_own(folder, k, trace, first.world, on_damage))
        for k in range(1, len(first.robots))
    )


OnDamage = Callable[[str], None]
"""Told one line for each file that cannot be read; the run is then read without it."""


def read_run(folder: Path, *, robot: int = 0, on_damage: OnDamage | None = None) -> RunData:
    """Read a run folder; what is missing stays empty.

    Parameters
    ----------
    folder
        Folder written by a run: at least ``metrics.json`` and ``trace.parquet``.
    robot
        Whose rows and files, where there are several.
    on_damage
        Where given, a damaged file is told to it and left out; else it is an error, as it always is for those
        two.

    Raises
    ------
    InputError
        One line, where the folder is not a run folder or one of its files cannot be read.
    """
    check_folder(folder)
    missing = [name for name in (METRICS_FILE, TRACE_FILE) if not (folder / name).exists()]
    if missing:
        raise InputError(f"{folder}: not a run folder; expected {' and '.join(missing)} in it")

    def part(read: Callable[[Path], T], empty: T) -> T:
        return _part(read, folder, empty, on_damage)

    metrics, trace = read_metrics(folder), read_trace(folder)
    nothing: tuple[Mapping[str, Any], str] = ({}, "")
    mission, mission_text = part(read_mission, nothing)
    world = part(read_world, World())
    return RunData(
        run_dir=folder,
        mission=mission,
        mission_text=mission_text,
        metrics=metrics,
        events=part(read_events, ()),
        world=world,
        terrain=part(read_terrain, None),
        grid=part(read_grid_layer, None),
        people=part(read_people_tracks, PeopleTracks()),
        patrol=part(read_patrol, None),
        localizer_text=part(read_localizer, ""),
        robot=robot,
        robots=trace.robots,
        **_own(folder, robot, trace, world, on_damage),
    )


class _Own(TypedDict):
    """What differs from robot to robot of a run."""

    trace: Trace
    plans: tuple[Plan, ...]
    mapped_points_m: FloatArray
    shortest_path_m: FloatArray
    updates: tuple[RecordedUpdate, ...]
    sightings: Sightings
    sheet: SheetData | None
    own_map: OccupancyGrid | None


def _own(folder: Path, robot: int, trace: Trace, world: World, on_damage: OnDamage | None) -> _Own:
    """What a run folder tells of one robot alone; ``trace`` has the rows of all."""
    place = robot_folder(folder, robot)

    def part(read: Callable[[Path], T], empty: T) -> T:
        return _part(read, place, empty, on_damage)

    plans = part(read_plans, Plans())
    return _Own(
        trace=_drawable(trace.of(robot)),
        plans=plans.plans,
        mapped_points_m=plans.mapped_points_m,
        shortest_path_m=plans.shortest_path_m,
        updates=part(read_updates, ()),
        sightings=part(read_sightings, Sightings()),
        sheet=part(lambda own: read_cells(own, world), None),
        own_map=part(read_own_map, None),
    )


def _part(read: Callable[[Path], T], place: Path, empty: T, on_damage: OnDamage | None) -> T:
    """What one file tells; ``empty`` where it is damaged and somebody wants to hear of it."""
    try:
        return read(place)
    except InputError as error:
        if on_damage is None:
            raise
        on_damage(str(error))
        return empty


def _drawable(trace: Trace) -> Trace:
    """What of a trace can be drawn: infinities and places beyond all maps are NaN.

    A lost robot's belief holds something in place of a pose: it claims none, so that is NaN as well.
    """
    localized = trace.columns.get("localized")
    lost = None if localized is None or not bool((localized < 0.5).any()) else localized < 0.5
    columns = {}
    for name, values in trace.columns.items():
        unfit = np.isinf(values)
        if name.endswith(PLACES):
            unfit |= np.abs(values) > FARTHEST_M
        if lost is not None and name.startswith(("est_", "cov_", "nees")):
            unfit |= lost
        denormal = (np.abs(values) < LEAST) & (values != 0.0)
        drawn = np.where(unfit, np.nan, values) if bool(unfit.any()) else values
        columns[name] = np.where(denormal, 0.0, drawn) if bool(denormal.any()) else drawn
    return Trace(columns, trace.steps)
