"""The BARN benchmark: every course a mission of its own, built and driven as all missions are."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.plugins import named_plugins
from pilotage.evaluation.barn import BarnRun, lane_within, summarize
from pilotage.evaluation.least_time import time_bound_s
from pilotage.experiments.barn_bounds import bounds_of, has_way
from pilotage.experiments.build.build import build
from pilotage.experiments.build.robots import footprint_of
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.experiments.run_pool import all_done
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

MISSION = "barn-course"
"""What the courses are put into: robot, sensors, stack, and how it is judged."""
DISTANCE_SCALE_STD, ANGLE_SCALE_STD = 0.01, 0.02
"""Errors of the odometry's scales, drawn for each run: tyre pressure, and skid steering on another floor."""
Values = Mapping[str, Any]
OnRun = Callable[[int, int], None]


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

    Parameters
    ----------
    on_run
        Called after each run with how many are done and how many there are.

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
    jobs = [
        (world, trial, controller)
        for world in open_worlds
        for trial in range(request.trials)
        for controller in request.controllers
    ]
    done: dict[str, list[BarnRun]] = {controller: [] for controller in request.controllers}
    # Without the courses, which each job brings its own of.
    slim = replace(request, worlds=())
    drive = partial(drive_world, slim, base)
    for number, (job, run) in enumerate(all_done(drive, jobs, request.workers, "bench barn"), start=1):
        done[job[2]].append(run)
        if on_run is not None:
            on_run(number, len(jobs))
    drove = {world.number for world in open_worlds}
    return BarnAnswer(
        request,
        {name: tuple(sorted(runs, key=lambda run: (run.world, run.trial))) for name, runs in done.items()},
        tuple(world.number for world in request.worlds if world.number not in drove),
    )


def course_base() -> dict[str, Any]:
    """What courses are put into, with the plugins that are loaded here: workers load them as well."""
    return {**read_mission(MISSION), "plugins": list(named_plugins())}


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


def drive_world(request: BarnRequest, base: Values, world: BarnWorld, trial: int, controller: str) -> BarnRun:
    """Drive one course once, and judge it as the challenge does: first contact fails, so does time."""
    experiment = build(course_mission(request, base, world, trial, controller))
    finished = run_loop(experiment).finished
    body, goal = experiment.simulator.bodies[0], experiment.mission.world.goal
    assert goal is not None, "set above"
    collided = body.collisions > 0
    away_m = math.hypot(body.pose.x_m - goal.x_m, body.pose.y_m - goal.y_m)
    success = not collided and away_m <= goal.tolerance_m
    timeout = not (success or collided)
    time_s = TIME_LIMIT_S if timeout else finished.duration_s
    robot = experiment.team[0].known
    limits = robot.motion.top_speed_m_s, robot.motion.braking_m_s2
    bound_s = _bound_s(world.circles_m.tobytes(), robot.footprint.inner_radius_m, *limits)
    return BarnRun(world.number, trial, success, collided, timeout, time_s, world.optimal_time_s, bound_s)


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
    found = summarize(runs)
    return {
        "metric": found.metric,
        "success": found.success,
        "collision": found.collision,
        "timeout": found.timeout,
        "time_s": found.time_s,
        "over_bound": found.over_bound,
        "trials": found.trials,
        "worlds": found.worlds,
    }


def first_worlds(worlds: Sequence[BarnWorld], count: int | None) -> tuple[BarnWorld, ...]:
    """So many of the worlds, evenly spread over their numbers; all for None."""
    if count is None or count >= len(worlds):
        return tuple(worlds)
    return tuple(worlds[int(i)] for i in np.arange(count) * len(worlds) // count)


def replay_missions(answer: BarnAnswer, controller: str, count: int) -> list[tuple[BarnRun, Mission]]:
    """The worst runs of a controller as missions: each drives as it did."""
    base = course_base()
    worlds = {world.number: world for world in answer.request.worlds}
    worst = sorted(answer.runs[controller], key=lambda run: (run.metric, -run.time_s))[:count]
    return [
        (run, course_mission(answer.request, base, worlds[run.world], run.trial, controller)) for run in worst
    ]
