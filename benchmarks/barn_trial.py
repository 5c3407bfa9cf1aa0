"""Local controllers on the BARN courses, in a loop of their own: for tuning, until the real loop drives them.

python -m benchmarks.barn_trial ../shared/data/barn --worlds 30 --trials 1 --controller gap-horizon --set weak
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.evaluation.barn import BarnRun, summarize
from pilotage.kernels.control.footprint import discs_clearance, first_contact
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.scans.rays import add_range_noise, fan_ranges
from pilotage.logs.barn import GOAL_AHEAD_M, GOAL_TOLERANCE_M, START, TIME_LIMIT_S, BarnWorld, read_barn
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalLimits, LocalView

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
MOUNT = Pose2(0.12, 0.0, 0.0)
SUBSTEP_S = 0.01
STANDS_M_S = 0.02
STANDS_RAD_S = 0.05
"""Slower than this a robot stands."""
NO_SEGMENTS = np.zeros((0, 4))


@dataclass(frozen=True, slots=True)
class Setting:
    """What a trial is driven under.

    Jackal: 2 m/s and 4 rad/s as in its maker's jackal_control. The acceleration limits given there (20 m/s^2,
    25 rad/s^2) are above what tyres hold; 3 m/s^2 and 6 rad/s^2 are those of the same maker's husky_control.
    ``true_share`` scales the true limits against those that the controller is told (delay the other way).
    """

    speed: float = 2.0
    acceleration: float = 3.0
    turn_rate: float = 4.0
    turn_acceleration: float = 6.0
    reverse: float = 0.5
    delay_s: float = 0.0
    true_share: float = 1.0
    rate_hz: float = 20.0
    beams: int = 720
    range_std_m: float = 0.01
    odometry: float = 1.0
    max_range_m: float = 30.0


SETTINGS = {
    "base": Setting(),
    "weak": Setting(acceleration=1.0, delay_s=0.1),
    "worse": Setting(true_share=0.7),
    "weak-worse": Setting(acceleration=1.0, delay_s=0.1, true_share=0.7),
    "odometry": Setting(odometry=4.0),
    "noise": Setting(range_std_m=0.03),
    "slow": Setting(rate_hz=10.0),
    "sparse": Setting(beams=180),
    "all": Setting(odometry=4.0, range_std_m=0.03, rate_hz=10.0, beams=180),
    "dwa-theirs": Setting(speed=0.5),
}


def drive_course(
    circles: FloatArray,
    start: tuple[float, float, float],
    goal: tuple[float, float],
    tolerance_m: float,
    limit_s: float,
    controller: str,
    parameters: dict[str, Any],
    setting: Setting,
    seed: int,
    trace: list[tuple[float, ...]] | None = None,
    bodies: Callable[[float], FloatArray] | None = None,
    segments: FloatArray = NO_SEGMENTS,
) -> tuple[str, float, int]:
    """Drive one course; returns the outcome (success, collision, timeout), the time and the control steps.

    ``segments`` (N, 4) are walls out of the robot's reach: seen, not touched.
    ``bodies`` gives moving discs (N, 3) at a time; touching one is a collision where the robot was moving,
    and the discs go through a robot that stands.

    Odometry at noise 1: scale errors of 1 % (driving) and 2 % (turning) a run, and random walks of 0.01 m per
    square root of a metre and 0.01 rad per square root of a metre or radian.
    """
    rng = np.random.default_rng(seed)
    entry = LOCAL_CONTROLLERS.entry(controller)
    config = LOCAL_CONTROLLERS.configure(controller, parameters, controller)
    driver = entry.factory(config, np.random.default_rng([seed, 1]))
    told = LocalLimits(
        setting.speed,
        setting.reverse,
        setting.acceleration,
        setting.acceleration,
        setting.turn_rate,
        setting.turn_acceleration,
        setting.delay_s,
    )
    share = setting.true_share
    true = Drive(
        setting.speed * share,
        setting.reverse * share,
        setting.acceleration * share,
        setting.acceleration * share,
        setting.turn_rate * share,
        setting.turn_acceleration * share,
    )
    delay = setting.delay_s / share
    span = math.radians(270.0)
    angles = np.linspace(-0.5 * span, 0.5 * span, setting.beams)
    step_rad = float(angles[1] - angles[0])
    x, y, theta = start
    v = w = 0.0
    odometry = [x, y, theta]
    scale_d = 1.0 + 0.01 * setting.odometry * rng.standard_normal()
    scale_a = 1.0 + 0.02 * setting.odometry * rng.standard_normal()
    period = 1.0 / setting.rate_hz
    substeps = round(period / SUBSTEP_S)
    pending: deque[tuple[float, Twist]] = deque()
    active = Twist(0.0, 0.0)
    t = 0.0
    steps = 0
    clear = discs_clearance(x, y, theta, JACKAL, circles)
    standing = circles
    while t < limit_s - 1e-9:
        if bodies is not None:
            circles = np.vstack([standing, bodies(t)])
        c, s = math.cos(theta), math.sin(theta)
        sx, sy = x + c * MOUNT.x_m - s * MOUNT.y_m, y + s * MOUNT.x_m + c * MOUNT.y_m
        ranges = fan_ranges(
            sx,
            sy,
            theta + float(angles[0]),
            step_rad,
            setting.beams,
            setting.max_range_m,
            segments,
            circles,
        )
        ranges = add_range_noise(
            ranges, rng.standard_normal(setting.beams), setting.range_std_m, setting.max_range_m
        )
        view = LocalView(
            t,
            Pose2(odometry[0], odometry[1], odometry[2]),
            Twist(v + 0.01 * rng.standard_normal() * abs(v), w + 0.01 * rng.standard_normal() * abs(w)),
            ranges,
            angles,
            MOUNT,
            setting.max_range_m,
            goal,
            told,
            JACKAL,
            0.25 * tolerance_m,
        )
        pending.append((t + delay, driver.step(view)))
        steps += 1
        if trace is not None:
            trace.append((t, x, y, theta, v, w))
        for _ in range(substeps):
            while pending and pending[0][0] <= t + 1e-9:
                active = pending.popleft()[1]
            nx, ny, ntheta, nv, nw = advance(x, y, theta, v, w, active.v_m_s, active.w_rad_s, SUBSTEP_S, true)
            distance, angle = 0.5 * (v + nv) * SUBSTEP_S, 0.5 * (w + nw) * SUBSTEP_S
            if bodies is not None:
                moving = abs(distance) > SUBSTEP_S * STANDS_M_S or abs(angle) > SUBSTEP_S * STANDS_RAD_S
                if moving and discs_clearance(nx, ny, ntheta, JACKAL, bodies(t + SUBSTEP_S)) <= 0.0:
                    return "collision", t, steps
            elif clear <= abs(distance) + 0.34 * abs(angle):
                driven, _ = first_contact(x, y, theta, distance, angle, JACKAL, circles)
                if driven < 1.0:
                    return "collision", t, steps
            clear = 0.0 if bodies is not None else discs_clearance(nx, ny, ntheta, JACKAL, circles)
            x, y, theta, v, w = nx, ny, ntheta, nv, nw
            moved = (
                scale_d * distance
                + 0.01 * setting.odometry * math.sqrt(abs(distance)) * rng.standard_normal()
            )
            turned = (
                scale_a * angle
                + 0.01 * setting.odometry * math.sqrt(abs(angle) + abs(distance)) * rng.standard_normal()
            )
            odometry = list(exact_arc(odometry[0], odometry[1], odometry[2], moved, turned))
            t += SUBSTEP_S
            if math.hypot(x - goal[0], y - goal[1]) <= tolerance_m:
                return "success", t, steps
    return "timeout", limit_s, steps


def drive_world(
    world: BarnWorld, trial: int, controller: str, parameters: dict[str, Any], setting: Setting
) -> BarnRun:
    """One run as the challenge judges it."""
    goal = (START[0], START[1] + GOAL_AHEAD_M)
    outcome, t, _ = drive_course(
        world.circles_m,
        START,
        goal,
        GOAL_TOLERANCE_M,
        TIME_LIMIT_S,
        controller,
        parameters,
        setting,
        1000 * world.number + trial,
    )
    return BarnRun(
        world.number,
        trial,
        outcome == "success",
        outcome == "collision",
        outcome == "timeout",
        t,
        world.optimal_time_s,
    )


def _job(job: tuple[BarnWorld, int, str, dict[str, Any], Setting]) -> tuple[BarnRun, float]:
    begin = time.process_time()
    run = drive_world(*job)
    return run, time.process_time() - begin


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--controller", default="gap-horizon")
    parser.add_argument("--worlds", type=int, default=30, help="every so-manieth, to get about so many")
    parser.add_argument("--trials", type=int, default=1)
    parser.add_argument("--first-trial", type=int, default=0)
    parser.add_argument("--set", default="base", choices=sorted(SETTINGS))
    parser.add_argument("--parameters", type=json.loads, default={})
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--speed", type=float)
    parser.add_argument("--verbose", action="store_true")
    args = parser.parse_args()
    worlds = read_barn(args.folder)
    every = max(1, len(worlds) // args.worlds)
    worlds = worlds[::every][: args.worlds]
    setting = SETTINGS[args.set]
    if args.speed:
        setting = replace(setting, speed=args.speed)
    jobs = [
        (world, trial, args.controller, args.parameters, setting)
        for world in worlds
        for trial in range(args.first_trial, args.first_trial + args.trials)
    ]
    begin = time.time()
    if args.workers > 1:
        with multiprocessing.get_context("spawn").Pool(args.workers) as pool:
            done = list(pool.imap_unordered(_job, jobs, chunksize=2))
    else:
        done = [_job(job) for job in jobs]
    done.sort(key=lambda one: (one[0].world, one[0].trial))
    runs = [run for run, _ in done]
    if args.verbose:
        for run, cpu in done:
            word = "ok" if run.success else "COLLISION" if run.collision else "TIMEOUT"
            print(
                f"{run.world:4d} {run.trial:2d} {word:9s} {run.time_s:6.2f} "
                f"{2 * run.optimal_time_s:6.2f} {run.metric:.4f} cpu {cpu:.2f}"
            )
    else:
        print(
            "failed:",
            [
                (run.world, run.trial, "c" if run.collision else "t", round(run.time_s, 1))
                for run in runs
                if not run.success
            ],
        )
    summary = asdict(summarize(runs))
    summary = {k: round(value, 5) if isinstance(value, float) else value for k, value in summary.items()}
    driven = sum(run.time_s for run in runs)
    cpu_s = sum(cpu for _, cpu in done)
    print(
        json.dumps(
            {
                "controller": args.controller,
                "set": args.set,
                **summary,
                "real_time_factor_per_core": round(driven / cpu_s, 1),
                "wall_s": round(time.time() - begin, 1),
            }
        )
    )


if __name__ == "__main__":
    main()
