"""What benchmarks on courses share: the mission that courses are put into, all runs, and what they leave."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from pilotage.core.errors import InputError
from pilotage.core.plugins import named_plugins
from pilotage.core.whole_file import write_whole
from pilotage.evaluation.finished import FinishedRun
from pilotage.experiments.build.build import Experiment, build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import read_mission
from pilotage.experiments.result_rows import Cell, write_rows
from pilotage.experiments.run import run_mission
from pilotage.experiments.run_pool import all_done
from pilotage.missions.mission import Mission

MISSION = "barn-course"
"""What the courses are put into: robot, sensors, stack, and how it is judged."""
SUMMARY, REPLAYS = "summary.json", "replays"
Values = Mapping[str, Any]
OnRun = Callable[[int, int], None]
"""Called after each run with how many are done and how many there are."""
C = TypeVar("C")
R = TypeVar("R")
K = TypeVar("K")


def course_base() -> dict[str, Any]:
    """What courses are put into, with the plugins that are loaded here: workers load them as well."""
    return {**read_mission(MISSION), "plugins": list(named_plugins())}


def led_by(controller: str, overrides: tuple[str, ...]) -> tuple[str, ...]:
    """The overrides on top of a controller, whose parameters they may set.

    Raises
    ------
    InputError
        Where they name another one.
    """
    if any(text.startswith("stack.local_controller.name=") for text in overrides):
        raise InputError(
            "--set stack.local_controller.name: expected no name, found one; say --controller NAME"
        )
    return (f"stack.local_controller.name={json.dumps(controller)}", *overrides)


def drive_all(
    drive: Callable[[C, int, str], R],
    courses: Sequence[C],
    trials: int,
    controllers: Sequence[str],
    workers: int,
    what: str,
    on_run: OnRun | None,
) -> dict[str, list[R]]:
    """Drive every course so often with every controller; the runs of each, as they came in."""
    jobs = [
        (course, trial, controller)
        for course in courses
        for trial in range(trials)
        for controller in controllers
    ]
    done: dict[str, list[R]] = {controller: [] for controller in controllers}
    for number, (job, run) in enumerate(all_done(drive, jobs, workers, what), start=1):
        done[job[2]].append(run)
        if on_run is not None:
            on_run(number, len(jobs))
    return done


@dataclass(frozen=True, slots=True)
class Driven:
    """One run on a course, judged as the BARN challenge does: the first contact fails."""

    experiment: Experiment
    finished: FinishedRun
    success: bool
    collision: bool

    @property
    def ending(self) -> tuple[bool, bool, bool]:
        """Success, collision and timeout: exactly one is true."""
        return self.success, self.collision, not (self.success or self.collision)


def drive_course_mission(mission: Mission) -> Driven:
    """Drive the mission of one course."""
    experiment = build(mission)
    finished = run_loop(experiment).finished
    body, goal = experiment.simulator.bodies[0], experiment.mission.world.goal
    assert goal is not None, "every course has one"
    away_m = math.hypot(body.pose.x_m - goal.x_m, body.pose.y_m - goal.y_m)
    collided = body.collisions > 0
    return Driven(experiment, finished, not collided and away_m <= goal.tolerance_m, collided)


def write_results(
    folder: Path, columns: Sequence[str], rows: Sequence[Sequence[Cell]], values: Mapping[str, Any]
) -> None:
    """Write a row a run, and the numbers of all."""
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(folder, columns, rows)
    told = {**values, "result": _finite(values["result"])}
    text = json.dumps(told, indent=1, allow_nan=False)
    write_whole(folder / SUMMARY, text + "\n")


def row_of(run: Any) -> tuple[Cell, ...]:
    """The fields of a run, a dataclass, as a table takes them."""
    return tuple(int(value) if isinstance(value, bool) else value for value in asdict(run).values())


def _finite(value: object) -> object:
    """The same with None for what JSON has no number for: the time of runs of which none succeeded."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def drive_again(missions: Mapping[K, Mission], folder: Path) -> dict[K, Path]:
    """Drive runs once more for their replays; their run folders."""
    made = {}
    for key, mission in missions.items():
        result = run_mission(mission, out=folder / REPLAYS)
        assert result.run_dir is not None, "it is saved"
        made[key] = result.run_dir
    return made
