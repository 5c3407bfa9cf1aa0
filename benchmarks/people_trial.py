"""Crossing a place while recorded people walk there, in the loop of ``barn_trial``: for tuning.

python -m benchmarks.people_trial ../shared/data/people/biwi_eth.txt --trials 20
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.barn_trial import JACKAL, SETTINGS, drive_course

from pilotage.kernels.control.footprint import discs_clearance
from pilotage.logs.people import PeopleTracks, read_people

REACH_M = 6.0
TOLERANCE_M = 0.5
LIMIT_S = 30.0
HALL_M = 9.0
"""Half the width of the hall around: walls that the laser sees through the people's gaps."""
NOBODY = np.zeros((0, 3))


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
    setting = SETTINGS["base"]
    outcome, t, _ = drive_course(
        NOBODY,
        start,
        end,
        TOLERANCE_M,
        LIMIT_S,
        controller,
        parameters,
        setting,
        trial,
        trace,
        lambda now: tracks.discs_at(begin + now),
        hall,
    )
    _, empty, _ = drive_course(
        NOBODY, start, end, TOLERANCE_M, LIMIT_S, controller, parameters, setting, trial, segments=hall
    )
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
