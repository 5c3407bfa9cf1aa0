"""Success against bottleneck on generated courses, in the loop of ``barn_trial``: for tuning.

python -m benchmarks.courses_trial --widths 0.46 0.50 0.55 0.60 --courses 10
"""

from __future__ import annotations

import argparse
import json
import math
import time

import numpy as np
from benchmarks.barn_trial import JACKAL, SETTINGS, drive_course

from pilotage.kernels.control.pose_search import FOUND, passage
from pilotage.maps.courses import make_course

TOLERANCE_M = 0.5
LIMIT_S = 60.0


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
                JACKAL,
                course.circles_m,
                np.array([-2.5, -1.2]),
                np.array([2.5, y + 0.6]),
                0.04,
                0.0,
            )
            solvable += status == FOUND
            outcome, t, _ = drive_course(
                course.circles_m,
                course.start,
                course.goal_xy_m,
                TOLERANCE_M,
                LIMIT_S,
                args.controller,
                args.parameters,
                SETTINGS["base"],
                seed,
            )
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
