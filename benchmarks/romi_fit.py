"""The real Romi's faults from its six printed maps and its film: approximate Bayesian computation.

    python -m benchmarks.romi_fit draw FILE --draws 400 [--first-seed N] [--data ../shared/data/romi]
    python -m benchmarks.romi_fit fit FILE [--data ...] [--json OUT]

``draw`` takes parameters from the prior, drives the five configurations and the film's square with that
robot, and appends one line of summaries to FILE (it can be stopped and gone on with). ``fit`` accepts the
draws whose summaries lie nearest the real ones, adjusts the accepted ones by local linear regression
(Beaumont et al. 2002) and prints posterior medians with 95 % intervals, and what the accepted robots do.

Summaries of a map: cells printed as visited, marked as features, and free; of them right. Of a trial: truly
visited cells, those of them printed as visited, how long it lasted. Of the film: how unequal the legs of the
square are, the mean of its turns and their scatter. All by their median absolute deviation over the draws.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STANDSTILL, FloatArray
from pilotage.evaluation.cell_map_score import score_cell_map
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.maps.cell_map import CellMap, CellState, TrueCellMap
from pilotage.maps.cell_map_text import read_cell_map
from pilotage.maps.true_cells import read_true_map, true_map
from pilotage.stack.control.wheel_pursuit import pursue
from pilotage.stack.exploration.surround_check import SurroundCheck

DATA = Path(__file__).resolve().parents[2] / "shared" / "data" / "romi"
CONFIGURATIONS: dict[str, tuple[str, bool, bool]] = {
    "baseline": ("random-walk", False, False),
    "exploration": ("surround-check", False, False),
    "exploration, fusion": ("surround-check", True, False),
    "exploration, avoidance": ("surround-check", False, True),
    "exploration, fusion, avoidance": ("surround-check", True, True),
}
PRINTED = {
    "baseline": ("Base",),
    "exploration": ("WithoutSensorFusion_WithoutObstacleAvoidance",),
    "exploration, fusion": (
        "WithSensorFusion_WithoutObstacleAvoidance_V2",
        "WithSensorFusion_WithoutObstacleAvoidance",
    ),
    "exploration, avoidance": ("WithoutSensorFusion_WithObstacleAvoidance",),
    "exploration, fusion, avoidance": ("WithSensorFusion_WithObstacleAvoidance",),
}
FILMED = {
    "baseline": (69, 35, 75.0),
    "exploration": (102, 51, 260.0),
    "exploration, fusion": (245, 135, 384.0),
    "exploration, avoidance": (133, 54, 277.0),
    "exploration, fusion, avoidance": (182, 98, 381.0),
}
"""Table 2 of the report: truly visited cells, those of them right, seconds."""
LONGEST_S = 420.0
"""The report's longest trial lasted 384 s."""
KEYS = (
    "printed_visited",
    "features",
    "features_right",
    "free",
    "free_right",
    "visited",
    "visited_right",
    "s",
)
FILM_KEYS = ("leg_spread", "turn_mean", "turn_spread")
LEG_M = 0.216

PARAMETERS: dict[str, tuple[str, float, float]] = {
    "truncated": ("switch", 0.0, 1.0),
    "truncated_turn": ("switch", 0.0, 1.0),
    "lines_at_centre": ("switch", 0.0, 1.0),
    "pose_period_s": ("uniform", 0.01, 0.10),
    "slip": ("uniform", 0.0, 0.40),
    "separation_error": ("uniform", 0.0, 0.12),
    "radius_difference": ("uniform", 0.0, 0.04),
    "slip_std_m_sqrt_m": ("log", 0.0005, 0.03),
    "gyro_walk_deg_s_sqrt_s": ("log", 0.003, 0.3),
    "gyro_scale": ("uniform", 0.0, 0.10),
    "infrared_std": ("log", 0.02, 0.3),
    "blocked_s": ("log", 5.0, 120.0),
    "give_up_s": ("log", 20.0, 200.0),
}
"""The prior. The magnetometer is in none: all six maps were made without it."""


def drawn(rng: np.random.Generator) -> dict[str, float]:
    """One robot of the prior."""
    found = {}
    for name, (kind, low, high) in PARAMETERS.items():
        u = rng.random()
        if kind == "switch":
            found[name] = float(u < 0.5)
        elif kind == "log":
            found[name] = low * (high / low) ** u
        else:
            found[name] = low + (high - low) * u
    return found


def overrides(robot: Mapping[str, float], navigator: str, fusion: bool, avoidance: bool) -> list[str]:
    """A robot's parameters as a mission takes them."""
    slip, apart = robot["slip"], robot["separation_error"]
    values: dict[str, Any] = {
        "stack.navigator.name": navigator,
        "stack.navigator.fusion": fusion,
        "stack.navigator.avoidance": avoidance,
        "stack.navigator.firmware.truncated_wheel_speed": bool(robot["truncated"]),
        "stack.navigator.firmware.truncated_turn": bool(robot["truncated_turn"]),
        "stack.navigator.firmware.lines_at_centre": bool(robot["lines_at_centre"]),
        "stack.navigator.firmware.pose_period_s": round(robot["pose_period_s"], 2),
        "robot.motion.errors.slip": [0.8 * slip, 1.2 * slip],
        "robot.motion.errors.separation_error": [0.8 * apart, 1.2 * apart],
        "robot.motion.errors.radius_difference": robot["radius_difference"],
        "robot.motion.errors.slip_std_m_sqrt_m": robot["slip_std_m_sqrt_m"],
        "robot.sensors.gyroscope.bias_walk_rad_s_sqrt_s": math.radians(robot["gyro_walk_deg_s_sqrt_s"]),
        "robot.sensors.gyroscope.scale_error": robot["gyro_scale"],
        "task.blocked_s": robot["blocked_s"],
        "run.time_limit_s": LONGEST_S,
        "run.record_every_s": 1.0,
    }
    for sensor in ("ir_left", "ir_front", "ir_front2", "ir_right"):
        values[f"robot.sensors.{sensor}.range_std_fraction"] = robot["infrared_std"]
    if navigator == "surround-check":
        values["stack.navigator.give_up_s"] = robot["give_up_s"]
    return [f"{key}={json.dumps(value)}" for key, value in values.items()]


def map_summary(printed: CellMap, truth: TrueCellMap) -> list[float]:
    """What a printed map alone tells."""
    score = score_cell_map(printed, truth)
    shares = (score.features.of, score.features.correct, score.free.of, score.free.correct)
    return [float(np.count_nonzero(printed.holds(CellState.VISITED))), *map(float, shares)]


def trial(robot: Mapping[str, float], name: str, seed: int) -> tuple[list[float], str]:
    """One configuration's summary, in the order of ``KEYS``, and why it ended."""
    mission = load_mission("romi-explore", overrides(robot, *CONFIGURATIONS[name]), seed)
    experiment = build(mission)
    run = run_loop(experiment).finished
    verdict = experiment.task.judge(run)
    markings = experiment.chart.markings
    assert markings is not None
    assert markings.source is not None
    printed = run.robots[0].results["cells"]
    assert isinstance(printed, CellMap)
    truth = true_map(markings.source)
    visits = experiment.task._visits[0].visited  # type: ignore[attr-defined]
    right = float(np.count_nonzero(visits & printed.holds(CellState.VISITED)))
    found = [*map_summary(printed, truth), float(np.count_nonzero(visits)), right, run.duration_s]
    return found, str(verdict.metrics["reason"]).split("; touched")[0]


def square(robot: Mapping[str, float], fusion: bool, seed: int) -> list[float]:
    """The film's drive: four legs of three cells with quarter turns between, by the robot's own pose."""
    mission = load_mission("romi-explore", overrides(robot, "surround-check", fusion, False), seed)
    experiment = build(mission)
    member, simulator = experiment.team[0], experiment.simulator
    explorer = member.stack
    assert isinstance(explorer, SurroundCheck)
    own, drive, body = explorer._pose, explorer._drive, simulator.bodies[0]
    x, y = own.pose.x_m, own.pose.y_m
    corners = [(x, y + LEG_M), (x + LEG_M, y + LEG_M), (x + LEG_M, y), (x, y)]
    command, ends = STANDSTILL, [(body.pose.x_m, body.pose.y_m)]
    for _ in range(6000):
        pose = own.step(simulator.step([command])[0])
        if not own.aligned:
            continue
        if math.hypot(corners[0][0] - pose.x_m, corners[0][1] - pose.y_m) < 0.020:
            ends.append((body.pose.x_m, body.pose.y_m))
            corners.pop(0)
            if not corners:
                break
        command = pursue(pose, *corners[0], drive)
    return film_summary(np.array(ends)) if len(ends) == 5 else [math.nan] * 3


def film_summary(ends_m: FloatArray) -> list[float]:
    """Of a square's (5, 2) corners: spread of legs over their mean, mean and spread of turns (rad)."""
    legs = np.diff(ends_m, axis=0)
    lengths = np.hypot(*legs.T)
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turns = np.array([wrap_to_pi(float(turn)) for turn in np.diff(headings)])
    return [float(lengths.std() / lengths.mean()), float(turns.mean()), float(turns.std())]


def filmed(data: Path) -> list[float]:
    """The real film's, by where the tracked robot rests between its legs."""
    from pilotage.tracking.scene import TrackOptions, learn_scene
    from pilotage.tracking.track import follow

    film = data / "romi_on_map.mp4"
    track = follow(film, learn_scene(film, TrackOptions()))
    points = np.asarray(track.path.points_m)
    speed = np.hypot(*(points[10:] - points[:-10]).T)
    resting = np.concatenate([np.full(5, True), speed < 0.008, np.full(5, True)])
    edges = np.flatnonzero(np.diff(resting.astype(np.int64)))
    pieces = [piece for piece in np.split(np.arange(len(points)), edges + 1) if resting[piece[0]]]
    ends = np.array([np.median(points[piece], axis=0) for piece in pieces if len(piece) >= 15])
    keep = [0, *(i for i in range(1, len(ends)) if np.hypot(*(ends[i] - ends[i - 1])) > 0.1)]
    return film_summary(ends[keep][:5])


def real(data: Path) -> FloatArray:
    """The real robot's summaries, of several maps of one configuration their mean."""
    truth = read_true_map(data / "map.yaml")
    found: list[float] = []
    for name, files in PRINTED.items():
        maps = [map_summary(read_cell_map(data / "robot_maps" / f"{f}.txt"), truth) for f in files]
        found += [*np.mean(maps, axis=0).tolist(), *FILMED[name]]
    return np.array([*found, *filmed(data)])


def draw(path: Path, draws: int, first_seed: int) -> None:
    """Append draws to a file."""
    for seed in range(first_seed, first_seed + draws):
        robot = drawn(np.random.default_rng([13, seed]))
        trials = {name: trial(robot, name, seed) for name in CONFIGURATIONS}
        line = {
            "seed": seed,
            "robot": robot,
            "summary": [value for found, _ in trials.values() for value in found]
            + square(robot, bool(seed % 2), seed),
            "ends": {name: reason for name, (_, reason) in trials.items()},
        }
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def main() -> int:
    """Draw or fit."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("draw", "fit"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    if options.what == "draw":
        draw(options.file, options.draws, options.first_seed)
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
