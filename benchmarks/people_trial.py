"""Crossing a place while recorded people walk there, in a loop of its own: for tuning.

Missions have no people yet; here they walk as recorded, and touching one counts where the robot was moving.

python -m benchmarks.people_trial ../shared/data/people/biwi_eth.txt --trials 20
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.footprint import discs_clearance
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.scans.rays import add_range_noise, fan_ranges
from pilotage.logs.people import PeopleTracks, read_people
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalLimits, LocalView

REACH_M = 6.0
TOLERANCE_M = 0.5
LIMIT_S = 30.0
HALL_M = 9.0
"""Half the width of the hall around: walls that the laser sees through the people's gaps."""
NOBODY = np.zeros((0, 3))
JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
MOUNT = Pose2(0.12, 0.0, 0.0)
BEAMS, MAX_RANGE_M, RANGE_STD_M = 720, 30.0, 0.01
TOLD = LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
TRUE = Drive(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
SUBSTEP_S, SUBSTEPS = 0.01, 5
STANDS_M_S, STANDS_RAD_S = 0.02, 0.05
"""Slower than this a robot stands."""


def drive_course(
    start: tuple[float, float, float],
    goal: tuple[float, float],
    controller: str,
    parameters: dict[str, Any],
    seed: int,
    trace: list[tuple[float, ...]],
    bodies: Callable[[float], FloatArray],
    segments: FloatArray,
) -> tuple[str, float]:
    """Drive once; returns the outcome (success, collision, timeout) and the time.

    Touching one of the moving discs (N, 3) is a collision where the robot was moving; they go through a robot
    that stands. ``segments`` (N, 4) are walls out of the robot's reach: seen, not touched.

    Odometry: scale errors of 1 % (driving) and 2 % (turning) a run, and random walks of 0.01 m per square
    root of a metre and 0.01 rad per square root of a metre or radian.
    """
    rng = np.random.default_rng(seed)
    config = LOCAL_CONTROLLERS.configure(controller, parameters, controller)
    driver = LOCAL_CONTROLLERS.entry(controller).factory(config, np.random.default_rng([seed, 1]))
    angles = np.linspace(-0.75 * math.pi, 0.75 * math.pi, BEAMS)
    step_rad = float(angles[1] - angles[0])
    x, y, theta = start
    v = w = 0.0
    odometry = start
    scale_d = 1.0 + 0.01 * rng.standard_normal()
    scale_a = 1.0 + 0.02 * rng.standard_normal()
    t = 0.0
    while t < LIMIT_S - 1e-9:
        c, s = math.cos(theta), math.sin(theta)
        first = theta + float(angles[0])
        ranges = fan_ranges(
            x + c * MOUNT.x_m, y + s * MOUNT.x_m, first, step_rad, BEAMS, MAX_RANGE_M, segments, bodies(t)
        )
        ranges = add_range_noise(ranges, rng.standard_normal(BEAMS), RANGE_STD_M, MAX_RANGE_M)
        measured = Twist(v + 0.01 * rng.standard_normal() * abs(v), w + 0.01 * rng.standard_normal() * abs(w))
        command = driver.step(
            LocalView(
                t,
                Pose2(*odometry),
                measured,
                ranges,
                angles,
                MOUNT,
                MAX_RANGE_M,
                goal,
                TOLD,
                JACKAL,
                0.25 * TOLERANCE_M,
            )
        )
        trace.append((t, x, y, theta, v, w))
        for _ in range(SUBSTEPS):
            x, y, theta, nv, nw = advance(x, y, theta, v, w, command.v_m_s, command.w_rad_s, SUBSTEP_S, TRUE)
            distance, angle = 0.5 * (v + nv) * SUBSTEP_S, 0.5 * (w + nw) * SUBSTEP_S
            moving = abs(distance) > SUBSTEP_S * STANDS_M_S or abs(angle) > SUBSTEP_S * STANDS_RAD_S
            if moving and discs_clearance(x, y, theta, JACKAL, bodies(t + SUBSTEP_S)) <= 0.0:
                return "collision", t
            v, w = nv, nw
            moved = scale_d * distance + 0.01 * math.sqrt(abs(distance)) * rng.standard_normal()
            turned = scale_a * angle + 0.01 * math.sqrt(abs(angle) + abs(distance)) * rng.standard_normal()
            odometry = exact_arc(odometry[0], odometry[1], odometry[2], moved, turned)
            t += SUBSTEP_S
            if math.hypot(x - goal[0], y - goal[1]) <= TOLERANCE_M:
                return "success", t
    return "timeout", LIMIT_S


def crossing(
    tracks: PeopleTracks, trial: int, controller: str, parameters: dict[str, Any]
) -> tuple[str, float, float, float, float]:
    """Cross the middle of the place in a random direction at a random time.

    Returns the outcome, the time, that in the empty place, the closest distance and the share of time within
    half a metre of somebody.
    """
    rng = np.random.default_rng([trial, 2])
    middle = np.median(tracks.places_xy_m, axis=0)
    for _ in range(1000):
        angle = rng.uniform(-math.pi, math.pi)
        begin = rng.uniform(0.0, tracks.duration_s - 20.0)
        away = REACH_M * np.array([math.cos(angle), math.sin(angle)])
        x, y = middle - away
        # Somebody is there, but not where the robot starts.
        people = tracks.discs_at(begin)
        if people.shape[0] and discs_clearance(x, y, angle, JACKAL, people) > 1.0:
            break
    goal = middle + away
    start, end = (float(x), float(y), angle), (float(goal[0]), float(goal[1]))
    low, high = middle - HALL_M, middle + HALL_M
    hall = np.array(
        [
            [low[0], low[1], high[0], low[1]],
            [high[0], low[1], high[0], high[1]],
            [high[0], high[1], low[0], high[1]],
            [low[0], high[1], low[0], low[1]],
        ]
    )
    trace: list[tuple[float, ...]] = []
    outcome, t = drive_course(
        start, end, controller, parameters, trial, trace, lambda now: tracks.discs_at(begin + now), hall
    )
    _, empty = drive_course(start, end, controller, parameters, trial, [], lambda _: NOBODY, hall)
    near = [discs_clearance(row[1], row[2], row[3], JACKAL, tracks.discs_at(begin + row[0])) for row in trace]
    return outcome, t, empty, float(min(near)), float(np.mean(np.array(near) < 0.5))


def main() -> None:
    """Cross and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tracks", type=Path)
    parser.add_argument("--controller", default="gap-horizon")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--first-trial", type=int, default=0)
    parser.add_argument(
        "--parameters", type=json.loads, default={"ground": {"movers": {"enabled": True}, "fade_hits": 60}}
    )
    args = parser.parse_args()
    tracks = read_people(args.tracks)
    begin = time.time()
    rows = [
        crossing(tracks, trial, args.controller, args.parameters)
        for trial in range(args.first_trial, args.first_trial + args.trials)
    ]
    good = [row for row in rows if row[0] == "success"]
    print(
        json.dumps(
            {
                "tracks": args.tracks.name,
                "controller": args.controller,
                "trials": len(rows),
                "success": round(len(good) / len(rows), 4),
                "collisions": [args.first_trial + i for i, row in enumerate(rows) if row[0] == "collision"],
                "timeouts": [args.first_trial + i for i, row in enumerate(rows) if row[0] == "timeout"],
                "time_s": round(float(np.mean([row[1] for row in good])), 3),
                "time_lost": round(sum(row[1] for row in good) / sum(row[2] for row in good) - 1.0, 4),
                "closest_m": round(min(row[3] for row in rows), 3),
                "discomfort": round(float(np.mean([row[4] for row in rows])), 4),
                "wall_s": round(time.time() - begin, 1),
            }
        )
    )


if __name__ == "__main__":
    main()
