"""The BARN benchmark: every course a mission of its own, built and driven as all missions are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.evaluation.barn import BarnRun, lane_within, summarize
from pilotage.evaluation.least_time import time_bound_s
from pilotage.experiments.barn_bounds import bounds_of, has_way
from pilotage.experiments.build.robots import footprint_of
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
from pilotage.experiments.mission import mission_of
from pilotage.logs.barn import (
    GOAL_AHEAD_M,
    GOAL_TOLERANCE_M,
    START,
    TIME_LIMIT_S,
    BarnWorld,
    read_published,
)
from pilotage.missions.mission import Mission
from pilotage.stack.control.local.drive import polygon_around

INTERVAL = frozenset({"metric_low", "metric_high"})
DISTANCE_SCALE_STD, ANGLE_SCALE_STD = 0.01, 0.02
"""Errors of the odometry's scales, drawn for each run: tyre pressure, and skid steering on another floor."""
COLUMNS = ("controller", *(part.name for part in fields(BarnRun)), "metric")


@dataclass(frozen=True, slots=True)
class BarnRequest:
    """What is to be driven.

    Attributes
    ----------
    controllers
        Registered names of local controllers.
    overrides
        ``key=value`` over the mission ``barn-course``, for all controllers alike.
    """

    worlds: tuple[BarnWorld, ...]
    controllers: tuple[str, ...]
    trials: int = 10
    workers: int = 1
    seed: int = 0
    overrides: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class BarnAnswer:
    """What came out.

    Attributes
    ----------
    runs
        By controller, in the order of worlds and trials; the same trial has the same seed for each.
    without_way
        Worlds that the robot does not fit through, which nobody drove.
    """

    request: BarnRequest
    runs: Mapping[str, tuple[BarnRun, ...]]
    without_way: tuple[int, ...]


def bench_barn(request: BarnRequest, on_run: OnRun | None = None) -> BarnAnswer:
    """Drive every course with every controller.

    Raises
    ------
    InputError
        Where a controller is unknown, or no course has a way that the robot fits through.
    """
    if not request.worlds:
        raise InputError("bench barn: expected one world or more, found none")
    base = course_base()
    for controller in request.controllers:
        course_mission(request, base, request.worlds[0], 0, controller)
    robot = mission_of(base, led_by(request.controllers[0], request.overrides)).robot
    outline = polygon_around(footprint_of(robot, "robot"))
    open_worlds = [world for world in request.worlds if has_way(world, outline)]
    if not open_worlds:
        raise InputError(
            "bench barn: expected a course with a way through, found the robot wider than the gaps of all "
            f"{len(request.worlds)}; take a smaller robot.footprint"
        )
    # Without the courses, which each job brings its own of.
    drive = partial(drive_world, replace(request, worlds=()), base)
    done = drive_all(
        drive, open_worlds, request.trials, request.controllers, request.workers, "bench barn", on_run
    )
    drove = {world.number for world in open_worlds}
    return BarnAnswer(
        request,
        {name: tuple(sorted(runs, key=lambda run: (run.world, run.trial))) for name, runs in done.items()},
        tuple(world.number for world in request.worlds if world.number not in drove),
    )


def course_mission(
    request: BarnRequest, base: Values, world: BarnWorld, trial: int, controller: str
) -> Mission:
    """The mission of one run; all its chance comes from the seed, the world's number and the trial.

    Raises
    ------
    InputError
        Where the controller or an override is not what it should be.
    """
    draw = np.random.default_rng([request.seed, world.number, trial])
    overrides = led_by(controller, request.overrides)
    mission = mission_of(base, overrides)
    settings: dict[str, Any] = {
        "run.seed": int(draw.integers(0, 2**62)),
        "run.time_limit_s": TIME_LIMIT_S,
        "world.start": dict(zip(("x_m", "y_m", "theta_rad"), START, strict=True)),
        "world.goal": {
            "x_m": START[0],
            "y_m": START[1] + GOAL_AHEAD_M,
            "tolerance_m": GOAL_TOLERANCE_M,
        },
        "world.map": {
            "map": f"barn-{world.number}",
            "bounds_m": list(bounds_of(world)),
            "walls_m": [],
            "circles_m": world.circles_m.tolist(),
        },
    }
    for name, sensor in mission.robot.sensors.items():
        if sensor.name == "wheel-odometry":
            for key, std in (("distance_scale", DISTANCE_SCALE_STD), ("angle_scale", ANGLE_SCALE_STD)):
                scale = float(sensor.parameters.get(key, 1.0)) + std * float(draw.standard_normal())
                settings[f"robot.sensors.{name}.{key}"] = scale
    settings["mission"] = f"barn-{world.number}-{trial}-{controller}"
    return mission_of(base, overrides, settings=settings)


def drive_world(request: BarnRequest, base: Values, world: BarnWorld, trial: int, controller: str) -> BarnRun:
    """Drive one course once; whom the time runs out has taken all of it."""
    driven = drive_course_mission(course_mission(request, base, world, trial, controller))
    timeout = driven.ending[2]
    time_s = TIME_LIMIT_S if timeout else driven.finished.duration_s
    robot = driven.experiment.team[0].known
    limits = robot.motion.top_speed_m_s, robot.motion.braking_m_s2
    bound_s = _bound_s(world.circles_m.tobytes(), robot.footprint.inner_radius_m, *limits)
    return BarnRun(world.number, trial, *driven.ending, time_s, world.optimal_time_s, bound_s)


@lru_cache(maxsize=512)
def _bound_s(circles: bytes, inner_radius_m: float, speed_m_s: float, acceleration_m_s2: float) -> float:
    """What no robot of these limits undercuts on a course; NaN where its inner disc has no way."""
    x, y, _ = START
    lane = lane_within(np.frombuffer(circles).reshape(-1, 3), y - 1.0, y + GOAL_AHEAD_M + 1.0)
    goal = (x, y + GOAL_AHEAD_M)
    bound = time_bound_s(lane, (x, y), goal, GOAL_TOLERANCE_M, inner_radius_m, speed_m_s, acceleration_m_s2)
    return math.nan if bound is None else bound


def published_runs(folder: Path, worlds: Sequence[BarnWorld]) -> dict[str, tuple[BarnRun, ...]]:
    """Results that lie beside the courses, of another simulator: by name, those of the given courses."""
    optimal_s = {world.number: world.optimal_time_s for world in worlds}
    found: dict[str, tuple[BarnRun, ...]] = {}
    for name, table in read_published(folder).items():
        runs: list[BarnRun] = []
        for world, succeeded, collided, timed_out, time_s in table.values[:, :5].tolist():
            if int(world) in optimal_s:
                trial = sum(run.world == int(world) for run in runs)
                flags = bool(succeeded), bool(collided), bool(timed_out)
                runs.append(BarnRun(int(world), trial, *flags, max(time_s, 0.0), optimal_s[int(world)]))
        if runs:
            found[name] = tuple(runs)
    return found


def summary_values(answer: BarnAnswer) -> dict[str, Any]:
    """What one controller reached, of several by name; ``worlds_without_way`` were not driven."""
    shut = {"worlds_without_way": len(answer.without_way)}
    summaries = {name: _summary(runs) | shut for name, runs in answer.runs.items()}
    return summaries[answer.request.controllers[0]] if len(summaries) == 1 else summaries


def _summary(runs: Sequence[BarnRun]) -> dict[str, Any]:
    return {key: value for key, value in asdict(summarize(runs)).items() if key not in INTERVAL}


def first_worlds(worlds: Sequence[BarnWorld], count: int | None) -> tuple[BarnWorld, ...]:
    """So many of the worlds, evenly spread over their numbers; all for None."""
    if count is None or count >= len(worlds):
        return tuple(worlds)
    return tuple(worlds[int(i)] for i in np.arange(count) * len(worlds) // count)


def write_barn(answer: BarnAnswer, folder: Path, replays: int) -> dict[tuple[str, int, int], Path]:
    """Write rows and numbers into a folder, and drive the worst runs of each controller once more.

    Returns
    -------
    Run folders by controller, world and trial.
    """
    request = answer.request
    values = {
        "controllers": list(request.controllers),
        "trials": request.trials,
        "seed": request.seed,
        "overrides": list(request.overrides),
        "without_way": list(answer.without_way),
        "result": summary_values(answer),
    }
    rows = [(name, *row_of(run), run.metric) for name, runs in answer.runs.items() for run in runs]
    write_results(folder, COLUMNS, rows, values)
    base, worlds = course_base(), {world.number: world for world in request.worlds}
    worst = {
        (name, run.world, run.trial): course_mission(request, base, worlds[run.world], run.trial, name)
        for name, runs in answer.runs.items()
        for run in sorted(runs, key=lambda run: (run.metric, -run.time_s))[:replays]
    }
    return drive_again(worst, folder)
