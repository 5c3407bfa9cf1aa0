"""The rover's estimators over many runs: do their regions hold the truth as often as they say?

``python -m benchmarks.gale [--runs 1000] [--reckoned 3000] [--json OUT]``: each task's drive once by truth,
then the estimators' kernels along it with noise of their own a run (the study ``gale-estimation`` runs whole
missions instead, fewer times). A run's steps share their error: intervals come from the runs.
"""

from __future__ import annotations

import argparse
import cmath
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.driving import poses
from pilotage.evaluation.position_region import squared_off
from pilotage.evaluation.terrain import stretches_without
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.kernels.filters import bent_region, rover_filter, rover_odometry
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

DRIVES = {"third task": "gale-ekf", "optional task": "gale-astar-ekf"}
INITIAL = np.diag([36.0, 36.0, math.radians(1.0) ** 2])
NOISE = np.diag([0.01, 1.9038589e-5])
DISTANCE_VAR_M2_PER_M, TURN_VAR_RAD2_PER_M, REACH_M = 4.0e-5, 1.9038589e-6, 500.0
GATE = chi_square_quantile(0.9999, 2)


@dataclass(frozen=True, slots=True)
class Drive:
    """True poses (T, 3), landmarks, and which are in reach: rows ``seen[first[k] : first[k + 1]]``."""

    truth: FloatArray
    ids: IntArray
    points: FloatArray
    seen: IntArray
    first: IntArray


def driven(name: str) -> Drive:
    """A mission's drive by the truth; its landmarks by id."""
    experiment = build(load_mission(name, ["run.oracles=[driver]"], 0))
    landmarks = experiment.chart.landmarks
    truth = poses(run_loop(experiment, None).finished.robots[0].trace, "true")
    order = np.argsort(landmarks.ids)
    points = np.ascontiguousarray(landmarks.points_xy_m[order])
    tree = cKDTree(points)
    near = [[]] + [sorted(tree.query_ball_point(place, REACH_M)) for place in truth[1:, :2]]
    first = np.concatenate([[0], np.cumsum([len(rows) for rows in near])])
    seen = np.array([row for rows in near for row in rows], dtype=np.int64)
    return Drive(truth, np.ascontiguousarray(landmarks.ids[order]), points, seen, first)


@kernel
def run(
    truth: FloatArray,
    start: FloatArray,
    odometry: FloatArray,
    ids: IntArray,
    points: FloatArray,
    seen: IntArray,
    first: IntArray,
    sighted: FloatArray,
    initial: FloatArray,
    R: FloatArray,
    gate: float,
    reckon: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(T, 3) errors, (T, 3, 3) covariances and (T, REGION) regions (of dead reckoning) of one run.

    ``start`` (3,) errors, ``odometry`` (T, 2) and ``sighted`` (S, 2) noise of unit variance.
    """
    steps = truth.shape[0]
    errors, covs = np.empty((steps, 3)), np.empty((steps, 3, 3))
    regions = np.empty((steps if reckon else 0, bent_region.REGION))
    mean, cov, anchor = truth[0].copy(), initial.copy(), np.full(1, -1, dtype=np.int64)
    for i in range(3):
        mean[i] += start[i] * math.sqrt(initial[i, i])
    refused, sums = np.zeros(1, dtype=np.int64), np.zeros(rover_odometry.SUMS, dtype=np.complex128)
    moves, knots, stretches = (
        np.zeros(bent_region.KNOTS, dtype=np.complex128),
        np.zeros((bent_region.KNOTS, 2)),
        0,
    )
    spread = np.zeros(bent_region.SUMS, dtype=np.complex128)
    spread[0] = initial[0, 0] + initial[1, 1]
    for k in range(steps):
        if k > 0:
            dx, dy = truth[k, 0] - truth[k - 1, 0], truth[k, 1] - truth[k - 1, 1]
            turn, distance = wrap(truth[k, 2] - truth[k - 1, 2]), math.hypot(dx, dy)
            aside = wrap(math.atan2(dy, dx) - truth[k - 1, 2]) if distance > 0.0 else 0.0
            q_distance, q_turn = DISTANCE_VAR_M2_PER_M * distance, TURN_VAR_RAD2_PER_M * distance
            turned = math.sqrt(q_turn) * odometry[k, 1]
            said = distance + math.sqrt(q_distance) * odometry[k, 0]
            increment = (said, aside + 0.5 * turned, turn + turned, q_distance, q_turn)
            if reckon:
                move = cmath.rect(said, mean[2] + increment[1])
                stretches = bent_region.add_move(moves, knots, spread, stretches, move, cov[2, 2], q_distance)
                rover_odometry.predict_second_order(mean, cov, sums, *increment)
            else:
                rover_filter.predict(mean, cov, anchor, *increment)
        a, b = first[k], first[k + 1]
        if reckon:
            bent_region.region(moves, knots, spread, stretches, regions[k])
            errors[k], covs[k] = truth[k] - mean, cov
        else:
            ranges, bearings = np.empty(b - a), np.empty(b - a)
            for j in range(a, b):
                dx, dy = points[seen[j], 0] - truth[k, 0], points[seen[j], 1] - truth[k, 1]
                ranges[j - a] = math.hypot(dx, dy) + math.sqrt(R[0, 0]) * sighted[j, 0]
                direction = math.atan2(dy, dx) - truth[k, 2]
                bearings[j - a] = wrap(direction + math.sqrt(R[1, 1]) * sighted[j, 1])
            rover_filter.update(
                mean, cov, anchor, ids[seen[a:b]], ranges, bearings, ids, points, R, gate, refused
            )
            rover_filter.moments(mean, cov, anchor, points, errors[k], covs[k])
            errors[k] = truth[k] - errors[k]
        errors[k, 2] = wrap(errors[k, 2])
    return errors, covs, regions


def judged(drive: Drive, runs: int, reckon: bool) -> dict[str, dict[str, float]]:
    """Over runs: shares of the steps in the regions, and mean NEES of pose and position."""
    values: dict[str, list[float]] = {}
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        errors, covs, regions = run(
            drive.truth,
            rng.standard_normal(3),
            rng.standard_normal((len(drive.truth), 2)),
            drive.ids,
            drive.points,
            drive.seen,
            drive.first,
            rng.standard_normal((len(drive.seen), 2)),
            INITIAL,
            NOISE,
            GATE,
            reckon,
        )
        off = squared_off(errors[:, :2], covs, regions if reckon else None)
        pose = np.einsum("ti,ti->t", errors, np.linalg.solve(covs, errors[:, :, None])[:, :, 0])
        found = {"in ellipse": off <= chi_square_quantile(0.95, 2), "position NEES": off, "NEES": pose}
        for share in (0.5, 0.8, 0.99):
            found[f"in {share:.0%} region"] = off <= chi_square_quantile(share, 2)
        for name, steps in found.items():
            values.setdefault(name, []).append(float(steps.mean()))
    half = {name: 1.96 * float(np.std(each)) / math.sqrt(runs) for name, each in values.items()}
    return {
        name: {
            "value": float(np.mean(each)),
            "low": float(np.mean(each)) - half[name],
            "high": float(np.mean(each)) + half[name],
            "n": runs,
        }
        for name, each in values.items()
    }


def main() -> int:
    """Measure and print; write the values where a file is named."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--reckoned", type=int, default=3000, help="runs of dead reckoning, which are cheap")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    values: dict[str, dict[str, float]] = {}
    for task, name in DRIVES.items():
        drive = driven(name)
        step_m = np.concatenate([[0.0], np.hypot(*np.diff(drive.truth[:, :2], axis=0).T)])
        blind = stretches_without(np.diff(drive.first), step_m)
        longest = max((float(step_m[a : b + 1].sum()) for a, b in blind), default=0.0)
        values[f"{task} :: blind stretches over 1 km"] = {"value": len(blind)}
        values[f"{task} :: longest blind stretch"] = {"value": longest}
        for filter_, runs, reckon in (
            ("EKF", options.runs, False),
            ("dead reckoning", options.reckoned, True),
        ):
            for key, value in judged(drive, runs, reckon).items():
                values[f"{task} :: {filter_} :: {key}"] = value
    for key, value in values.items():
        interval = f" ({value['low']:.4f} to {value['high']:.4f}, {value['n']} runs)" if "n" in value else ""
        sys.stdout.write(f"{key}: {value['value']:.4f}{interval}\n")
    if options.json is not None:
        options.json.write_text(json.dumps(values), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
