"""Local controllers side by side on courses of many kinds, each run a mission as all are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.shown import visible
from pilotage.evaluation.courses import CourseRun, summarize_courses
from pilotage.experiments.build.robots import footprint_of, motion_of
from pilotage.experiments.course_driving import (
    OnRun,
    Values,
    course_base,
    drive_again,
    drive_all,
    drive_course_mission,
    led_by,
    row_of,
    write_results,
)
from pilotage.experiments.course_families import DRAWN, Course, Driver, family_word, make_course_of
from pilotage.experiments.mission import mission_of
from pilotage.missions.mission import Mission
from pilotage.stack.control.local.drive import polygon_around
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS

TIME_LIMIT_S = 100.0
AMONG_PEOPLE: Mapping[str, Any] = {"ground.movers.enabled": True, "ground.fade_hits": 60}
"""What controllers with a rolling ground are told of a place: that somebody may move there."""
COLUMNS = ("controller", *(part.name for part in fields(CourseRun)))


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


def bench_controllers(request: CourseRequest, on_run: OnRun | None = None) -> CourseAnswer:
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
    done = drive_all(
        partial(drive_course, request, base),
        list(courses.values()),
        request.trials,
        request.controllers,
        request.workers,
        "bench controllers",
        on_run,
    )
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
    base: Values,
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
    draw = np.random.default_rng([request.seed, course.number, trial, *family_word(course.family)])
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
    request: CourseRequest, base: Values, course: Course, trial: int, controller: str
) -> CourseRun:
    """Drive once, and where there are people once more without them."""
    driven = drive_course_mission(course_run_mission(request, base, course, trial, controller))
    where = course.family, course.number, trial
    run = CourseRun(*where, *driven.ending, driven.finished.duration_s, course.bound_s)
    met = driven.finished.robots[0].encounters
    if met is not None:
        run = replace(
            run,
            people_collisions=met.collisions,
            people_touches=met.touches,
            closest_m=met.closest_m,
            near_share=met.near_share,
        )
    if course.people:
        alone = drive_course_mission(course_run_mission(request, base, course, trial, controller, empty=True))
        run = replace(run, empty_s=alone.finished.duration_s if alone.success else math.nan)
    return run


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
    request, base = answer.request, course_base()
    asked = {key: value for key, value in asdict(request).items() if key != "workers"}
    rows = [(name, *row_of(run)) for name, runs in answer.runs.items() for run in runs]
    write_results(folder, COLUMNS, rows, {**asked, "result": answer_values(answer)})
    worst = {
        (name, run.family, run.course, run.trial): course_run_mission(
            request, base, answer.courses[run.family, run.course], run.trial, name
        )
        for name, runs in answer.runs.items()
        for run in sorted(runs, key=worst_first)[:replays]
    }
    return drive_again(worst, folder)


def worst_first(run: CourseRun) -> tuple[bool, bool, float]:
    """Collisions first, then what was not reached, then the slowest against its bound."""
    return not run.collision, run.success, -run.time_s / run.bound_s
