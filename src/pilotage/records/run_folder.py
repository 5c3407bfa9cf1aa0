"""Writing a run folder: complete or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pilotage.core.drafts import clear_drafts, draft_prefix
from pilotage.core.types import Event
from pilotage.core.whole_file import made_folder, named
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.records.cells import SheetData, write_cells
from pilotage.records.events import write_events
from pilotage.records.grid import write_grid
from pilotage.records.localizer import write_localizer
from pilotage.records.metrics import write_metrics
from pilotage.records.mission import write_mission
from pilotage.records.patrol import PatrolRecord, write_patrol
from pilotage.records.people import PeopleTracks, write_people
from pilotage.records.plans import Plans, write_plans
from pilotage.records.scans import Sightings, write_sightings
from pilotage.records.terrain import TerrainPictures, write_terrain
from pilotage.records.trace import Trace, write_trace
from pilotage.records.updates import KeptUpdate, write_updates
from pilotage.records.world import World, write_world


@dataclass(frozen=True, slots=True)
class RobotFiles:
    """What one robot's journal leaves; None where it had nothing of the kind to tell."""

    plans: Plans | None = None
    sightings: Sightings | None = None
    updates: tuple[KeptUpdate, ...] = ()
    cells: SheetData | None = None
    own_map: OccupancyGrid | None = None


@dataclass(frozen=True, slots=True)
class RunFiles:
    """What a run leaves.

    Attributes
    ----------
    trace, metrics, events
        Every run has them.
    mission_text, localizer_text
        YAML: the mission in full, or for a recorded log its localizer; '' leaves the file out.
    world, terrain, grid, people, patrol
        None leaves the file out.
    robots
        One a robot, in the order of the trace's; the first one's files lie in the run folder itself, those of
        the others in ``robot-1``, ``robot-2`` and so on inside it.
    """

    trace: Trace
    metrics: Mapping[str, object]
    events: tuple[Event, ...] = ()
    mission_text: str = ""
    localizer_text: str = ""
    world: World | None = None
    terrain: TerrainPictures | None = None
    grid: OccupancyGrid | None = None
    people: PeopleTracks | None = None
    patrol: PatrolRecord | None = None
    robots: tuple[RobotFiles, ...] = ()


def robot_folder(folder: Path, robot: int) -> Path:
    """Where the files of one robot's journal lie."""
    return folder if robot == 0 else folder / f"robot-{robot}"


def write_run(out: Path, name: str, files: RunFiles) -> Path:
    """Write a run folder ``name`` under ``out``, complete or not at all, and return its path.

    ``metrics.json`` holds the metrics with ``run_dir``, the folder's path.
    """
    with draft_folder(out / name) as draft:
        write_trace(draft, files.trace)
        write_events(draft, files.events)
        if files.mission_text:
            write_mission(draft, files.mission_text)
        if files.localizer_text:
            write_localizer(draft, files.localizer_text)
        if files.world is not None:
            write_world(draft, files.world)
        if files.terrain is not None:
            write_terrain(draft, files.terrain)
        if files.grid is not None:
            write_grid(draft, files.grid)
        if files.people is not None:
            write_people(draft, files.people)
        if files.patrol is not None:
            write_patrol(draft, files.patrol)
        for robot, told in enumerate(files.robots):
            write_robot(robot_folder(draft, robot), told)
        write_metrics(draft, {**files.metrics, "run_dir": str(out / name)})
    return out / name


def write_robot(folder: Path, files: RobotFiles) -> None:
    """Write what one robot's journal leaves."""
    folder.mkdir(exist_ok=True)
    if files.plans is not None:
        write_plans(folder, files.plans)
    if files.sightings is not None:
        write_sightings(folder, files.sightings)
    write_updates(folder, files.updates)
    if files.cells is not None:
        write_cells(folder, files.cells)
    if files.own_map is not None:
        write_ros_map(folder / "map.yaml", RosMap.of(files.own_map, "map.pgm"))


@contextmanager
def draft_folder(final: Path) -> Iterator[Path]:
    """A folder that takes the place of ``final`` when it is whole, and vanishes where it is not.

    Everything is written beside it first, so that two runs at once do not mix and an interrupted one leaves
    nothing half-written, nor the folders that were made for it.
    """
    begin = draft_prefix(final)
    with made_folder(final.parent):
        with named(final, final.with_name(begin)):
            draft = Path(tempfile.mkdtemp(prefix=begin, dir=final.parent))
        try:
            draft.chmod(0o777 & ~_umask())
            with named(final, draft):
                yield draft
                replace_folder(draft, final)
            clear_drafts(final)
        except BaseException:
            shutil.rmtree(draft, ignore_errors=True)
            raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def replace_folder(draft: Path, final: Path) -> None:
    """Put ``draft`` in the place of ``final``, also where another process does the same at once."""
    for _ in range(100):
        if final.exists():
            old = Path(tempfile.mkdtemp(prefix=f"{draft_prefix(final)}old-", dir=final.parent))
            try:
                final.rename(old / "run")
            except FileNotFoundError:  # another process was quicker
                pass
            finally:
                shutil.rmtree(old, ignore_errors=True)
        try:
            draft.rename(final)
            return
        except OSError:
            if not final.exists():
                raise
    raise OSError(f"could not put the run folder into place: {final}")
