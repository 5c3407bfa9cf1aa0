"""Success against bottleneck on generated courses, each a mission as ``barn-course`` is: for tuning.

python -m benchmarks.courses_trial --widths 0.46 0.50 0.55 0.60 --courses 10
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any

import numpy as np

from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.kernels.control.pose_search import FOUND, passage
from pilotage.maps.courses import Course, make_course

TOLERANCE_M = 0.5
LIMIT_S = 60.0
LOW_M, HIGH_M = (-2.5, -1.2), (2.5, 0.6)
"""Of the search for a way: corners of the lane, the upper one from the goal on."""


def drive_course(course: Course, controller: str, parameters: dict[str, Any], seed: int) -> tuple[str, float]:
    """Drive a course; returns the outcome (success, collision, timeout) and the time."""
    x, y = course.goal_xy_m
    settings = {
        "run.seed": seed,
        "run.time_limit_s": LIMIT_S,
        "stack.local_controller": {"name": controller, **parameters},
        "world.start": dict(zip(("x_m", "y_m", "theta_rad"), course.start, strict=True)),
        "world.goal": {"x_m": x, "y_m": y, "tolerance_m": TOLERANCE_M},
        "world.map": {
            "map": f"course-{seed}",
            "bounds_m": [-4.5, -3.0, 4.5, y + 2.0],
            "walls_m": [],
            "circles_m": course.circles_m.tolist(),
        },
        "stack.navigator.arrival_m": 0.25 * TOLERANCE_M,
    }
    experiment = build(mission_of(read_mission("barn-course"), settings=settings))
    finished = run_loop(experiment).finished
    body = experiment.simulator.bodies[0]
    there = math.hypot(body.pose.x_m - x, body.pose.y_m - y) <= TOLERANCE_M
    outcome = "collision" if body.collisions else "success" if there else "timeout"
    return outcome, finished.duration_s


def main() -> None:
    """Make, search, drive and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--widths", type=float, nargs="+", default=[0.46, 0.5, 0.55, 0.6])
    parser.add_argument("--courses", type=int, default=10)
    parser.add_argument("--controller", default="gap-horizon")
    parser.add_argument("--parameters", type=json.loads, default={})
    args = parser.parse_args()
    for width in args.widths:
        begin = time.time()
        solvable = 0
        outcomes: list[tuple[str, float]] = []
        for seed in range(args.courses):
            course = make_course(width, np.random.default_rng([seed, round(1000 * width)]))
            x, y = course.goal_xy_m
            status, _ = passage(
                np.array(course.start),
                x,
                y,
                TOLERANCE_M,
                np.array(read_mission("barn-course")["robot"]["footprint"]["points_m"]),
                course.circles_m,
                np.array(LOW_M),
                np.array([HIGH_M[0], y + HIGH_M[1]]),
                0.04,
                0.0,
            )
            solvable += status == FOUND
            outcome, t = drive_course(course, args.controller, args.parameters, seed)
            outcomes.append((outcome, t))
        good = [t for outcome, t in outcomes if outcome == "success"]
        print(
            json.dumps(
                {
                    "width_m": width,
                    "courses": args.courses,
                    "solvable": solvable,
                    "success": len(good),
                    "collision": sum(outcome == "collision" for outcome, _ in outcomes),
                    "timeout": sum(outcome == "timeout" for outcome, _ in outcomes),
                    "time_s": round(float(np.mean(good)), 2) if good else math.nan,
                    "wall_s": round(time.time() - begin, 1),
                }
            ),
            flush=True,
        )


if __name__ == "__main__":
    main()
