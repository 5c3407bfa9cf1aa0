"""Local controllers side by side on courses of many kinds, each run a mission as all are."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.shown import visible
from pilotage.evaluation.courses import CourseRun, summarize_courses
from pilotage.experiments.barn_benchmark import course_base, led_by
from pilotage.experiments.barn_files import REPLAYS, SUMMARY, finite
from pilotage.experiments.build.build import build
from pilotage.experiments.build.robots import footprint_of, motion_of
from pilotage.experiments.course_families import DRAWN, Course, Driver, make_course_of
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.experiments.result_rows import write_rows
from pilotage.experiments.run import run_mission
from pilotage.experiments.run_pool import all_done
from pilotage.missions.mission import Mission
from pilotage.stack.control.local.drive import polygon_around
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS

TIME_LIMIT_S = 100.0
AMONG_PEOPLE: Mapping[str, Any] = {"ground.movers.enabled": True, "ground.fade_hits": 60}
"""What controllers with a rolling ground are told of a place: that somebody may move there."""
COLUMNS = (
    "controller",
    "family",
    "course",
    "trial",
    "success",
    "collision",
    "timeout",
    "time_s",
    "bound_s",
    "empty_s",
    "people_collisions",
    "people_touches",
    "closest_m",
    "near_share",
)


@dataclass(frozen=True, slots=True)
class CourseRequest:
    """What is to be driven.

    Attributes
    ----------
    families
        Names out of ``course_families.DRAWN``, map files, and files of people's tracks (``.txt``).
    courses, trials
        Of each family, and on each course.
    overrides
        ``key=value`` over the mission ``barn-course``, for all alike.
    """

    families: tuple[str, ...]
    controllers: tuple[str, ...]
    courses: int = 5
    trials: int = 2
    workers: int = 1
    seed: int = 0
    overrides: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CourseAnswer:
    """What came out: runs by controller, and by family how many of its courses have no way for the robot."""

    request: CourseRequest
    courses: Mapping[tuple[str, int], Course]
    runs: Mapping[str, tuple[CourseRun, ...]]
    without_way: Mapping[str, int]


def bench_controllers(
    request: CourseRequest, on_run: Callable[[int, int], None] | None = None
) -> CourseAnswer:
    """Drive every course with every controller.

    Raises
    ------
    InputError
        Where a family or a controller is unknown, a file cannot be read, or no course has a way.
    """
    base = course_base()
    for family in request.families:
        if family not in DRAWN and not Path(family).is_file():
            raise InputError(
                f"bench controllers: expected a map or tracks of people, or one of {', '.join(DRAWN)}, "
                f"found '{family}'"
            )
    robot = mission_of(base, led_by(request.controllers[0], request.overrides)).robot
    footprint = footprint_of(robot, "robot")
    driver = Driver(footprint, polygon_around(footprint), motion_of(robot, "robot"))
    courses: dict[tuple[str, int], Course] = {}
    without: dict[str, int] = {}
    for family in request.families:
        for number in range(request.courses):
            course = make_course_of(family, number, request.seed, driver)
            if course is None:
                without[family] = without.get(family, 0) + 1
            else:
                courses[family, number] = course
    if not courses:
        raise InputError("bench controllers: expected a course with a way through, found the robot too wide")
    first = next(iter(courses.values()))
    for controller in request.controllers:
        course_run_mission(request, base, first, 0, controller)
    jobs = [
        (course, trial, controller)
        for course in courses.values()
        for trial in range(request.trials)
        for controller in request.controllers
    ]
    done: dict[str, list[CourseRun]] = {controller: [] for controller in request.controllers}
    drive = partial(drive_course, request, base)
    for count, (job, run) in enumerate(all_done(drive, jobs, request.workers, "bench controllers"), start=1):
        done[job[2]].append(run)
        if on_run is not None:
            on_run(count, len(jobs))
    place = {family: index for index, family in enumerate(request.families)}
    return CourseAnswer(
        request,
        courses,
        {
            name: tuple(sorted(runs, key=lambda run: (place[run.family], run.course, run.trial)))
            for name, runs in done.items()
        },
        without,
    )


def course_run_mission(
    request: CourseRequest,
    base: Mapping[str, Any],
    course: Course,
    trial: int,
    controller: str,
    *,
    empty: bool = False,
) -> Mission:
    """The mission of one run; ``empty``: the same without people.

    Raises
    ------
    InputError
        Where the controller or an override is not what it should be.
    """
    draw = np.random.default_rng([request.seed, course.number, trial, *os.fsencode(course.family)])
    name = visible(Path(course.family).stem) if course.family not in DRAWN else course.family
    settings: dict[str, Any] = {
        "mission": f"{name}-{course.number}-{trial}-{controller}"[-100:],
        "run.seed": int(draw.integers(0, 2**62)),
        "run.time_limit_s": TIME_LIMIT_S,
        **course.settings,
        "world.people": [] if empty else list(course.people),
    }
    if course.people and "ground" in LOCAL_CONTROLLERS.entry(controller).config.model_fields:
        for key, value in AMONG_PEOPLE.items():
            settings[f"stack.local_controller.{key}"] = value
    return mission_of(base, led_by(controller, request.overrides), settings=settings)


def drive_course(
    request: CourseRequest, base: Mapping[str, Any], course: Course, trial: int, controller: str
) -> CourseRun:
    """Drive once, and where there are people once more without them."""
    run = _driven(request, base, course, trial, controller, empty=False)
    if course.people:
        alone = _driven(request, base, course, trial, controller, empty=True)
        run = replace(run, empty_s=alone.time_s if alone.success else math.nan)
    return run


def _driven(
    request: CourseRequest,
    base: Mapping[str, Any],
    course: Course,
    trial: int,
    controller: str,
    *,
    empty: bool,
) -> CourseRun:
    experiment = build(course_run_mission(request, base, course, trial, controller, empty=empty))
    finished = run_loop(experiment).finished
    body, goal = experiment.simulator.bodies[0], experiment.mission.world.goal
    assert goal is not None, "set above"
    there = math.hypot(body.pose.x_m - goal.x_m, body.pose.y_m - goal.y_m) <= goal.tolerance_m
    collided = body.collisions > 0
    success = there and not collided
    met = finished.robots[0].encounters
    run = CourseRun(
        course.family,
        course.number,
        trial,
        success,
        collided,
        not (success or collided),
        finished.duration_s,
        course.bound_s,
    )
    if met is None:
        return run
    return replace(
        run,
        people_collisions=met.collisions,
        people_touches=met.touches,
        closest_m=met.closest_m,
        near_share=met.near_share,
    )


def answer_values(answer: CourseAnswer) -> dict[str, Any]:
    """By controller: the numbers of all its runs, and under ``families`` those of each."""
    values: dict[str, Any] = {}
    for name, runs in answer.runs.items():
        values[name] = asdict(summarize_courses(runs)) | {
            "families": {family: asdict(summarize_courses(part)) for family, part in by_family(runs).items()}
        }
    return {"controllers": values, "without_way": dict(answer.without_way)}


def by_family(runs: Sequence[CourseRun]) -> dict[str, list[CourseRun]]:
    """The runs of each family, in their order."""
    found: dict[str, list[CourseRun]] = {}
    for run in runs:
        found.setdefault(run.family, []).append(run)
    return found


def write_answer(answer: CourseAnswer, folder: Path, replays: int) -> dict[tuple[str, str, int, int], Path]:
    """Write rows and numbers, and drive the worst runs of each controller once more for their replays.

    Returns
    -------
    Run folders by controller, family, course and trial.
    """
    import json

    folder.mkdir(parents=True, exist_ok=True)
    rows = [(name, *_row(run)) for name, runs in answer.runs.items() for run in runs]
    write_rows(folder, COLUMNS, rows)
    request = answer.request
    asked = {key: value for key, value in asdict(request).items() if key != "workers"}
    values = {**asked, "result": finite(answer_values(answer))}
    (folder / SUMMARY).write_text(json.dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    made = {}
    base = course_base()
    for name, runs in answer.runs.items():
        for run in sorted(runs, key=worst_first)[:replays]:
            course = answer.courses[run.family, run.course]
            result = run_mission(
                course_run_mission(request, base, course, run.trial, name), out=folder / REPLAYS
            )
            assert result.run_dir is not None, "it is saved"
            made[name, run.family, run.course, run.trial] = result.run_dir
    return made


def worst_first(run: CourseRun) -> tuple[bool, bool, float]:
    """Collisions first, then what was not reached, then the slowest against its bound."""
    return not run.collision, run.success, -run.time_s / run.bound_s


def _row(run: CourseRun) -> tuple[str | int | float, ...]:
    return tuple(int(value) if isinstance(value, bool) else value for value in asdict(run).values())
