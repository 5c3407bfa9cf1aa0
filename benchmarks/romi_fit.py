"""The real Romi's faults from its six printed maps and its film: approximate Bayesian computation.

    python -m benchmarks.romi_fit draw FIRST --draws 200
    python -m benchmarks.romi_fit draw SECOND --draws 200 --around FIRST
    python -m benchmarks.romi_fit fit SECOND --around FIRST [--json OUT]
    python -m benchmarks.romi_fit both FIRST --draws 200 --json OUT

``draw`` takes robots from the prior, or from around the nearest ones of an earlier file (population Monte
Carlo, Beaumont et al. 2009), drives the five configurations and the film's square with each, and appends a
line of summaries to the file; it can be stopped and gone on with. ``fit`` weighs the robots by prior over
proposal, keeps the nearest, and prints posterior medians with 95 % intervals, beside the real numbers what
the kept robots do, and what fusing the heading changes for them and for all robots of the prior: the ablation
with the fitted robot. (A regression on the summaries, Beaumont et al. 2002, was tried: of forty summaries
and a few dozen robots it made intervals of no width.)

Summaries of a map: cells printed as visited, marked as features, and free; of them right. Of a trial: truly
visited cells, those of them printed as visited, how long it lasted. Of the film: how unequal the legs of the
square are, the mean of its turns and their scatter. All by their median absolute deviation over the prior.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STANDSTILL, FloatArray
from pilotage.evaluation.cell_map_score import score_cell_map
from pilotage.evaluation.intervals import summarize
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.maps.cell_map import CellMap, CellState, TrueCellMap
from pilotage.maps.cell_map_text import read_cell_map
from pilotage.maps.true_cells import read_true_map, true_map
from pilotage.replicas.surround_check import SurroundCheck
from pilotage.stack.control.wheel_pursuit import pursue

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
CELLS = 625
ACCEPTED = 0.15
"""Share of the prior's robots that are near enough to draw around."""

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


def unit(robot: Mapping[str, float]) -> FloatArray:
    """A robot in the unit cube over which the prior is even; a switch is 0 or 1."""
    found = []
    for name, (kind, low, high) in PARAMETERS.items():
        value = robot[name]
        found.append(
            math.log(value / low) / math.log(high / low) if kind == "log" else (value - low) / (high - low)
        )
    return np.array(found)


def robot_of(place: FloatArray) -> dict[str, float]:
    """The robot at a place of the unit cube."""
    found = {}
    for u, (name, (kind, low, high)) in zip(place.tolist(), PARAMETERS.items(), strict=True):
        if kind == "switch":
            found[name] = float(u >= 0.5)
        else:
            found[name] = low * (high / low) ** u if kind == "log" else low + (high - low) * u
    return found


SWITCHES = np.array([kind == "switch" for kind, _, _ in PARAMETERS.values()])
FLIPS = 0.2
"""How often a switch is turned in a proposal."""


@dataclass(frozen=True)
class Around:
    """A proposal: one of (K, P) weighted places, moved by a normal kernel of (P,) widths inside the cube."""

    places: FloatArray
    weights: FloatArray
    widths: FloatArray

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """One place; those that fall out of the cube are drawn anew."""
        while True:
            place: FloatArray = self.places[rng.choice(len(self.places), p=self.weights)].copy()
            flips = SWITCHES & (rng.random(len(place)) < FLIPS)
            place[flips] = 1.0 - place[flips]
            place[~SWITCHES] += self.widths[~SWITCHES] * rng.standard_normal(int((~SWITCHES).sum()))
            if ((place >= 0.0) & (place <= 1.0)).all():
                return place

    def density(self, place: FloatArray) -> float:
        """Of the proposal, up to a factor; what falls out is drawn anew, which changes next to nothing."""
        away = (self.places - place)[:, ~SWITCHES] / self.widths[~SWITCHES]
        turned = (self.places[:, SWITCHES] != place[SWITCHES]).sum(axis=1)
        same = int(SWITCHES.sum()) - turned
        kernel = np.exp(-0.5 * np.square(away).sum(axis=1)) * FLIPS**turned * (1.0 - FLIPS) ** same
        return float(self.weights @ kernel)


def drawn(rng: np.random.Generator, around: Around | None) -> dict[str, float]:
    """One robot of the prior, or of a proposal."""
    if around is not None:
        return robot_of(around.draw(rng))
    place = rng.random(len(PARAMETERS))
    place[SWITCHES] = 1.0 - place[SWITCHES]  # as the published draws have them
    return robot_of(place)


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
    visits = verdict.extras[f"{run.robots[0].name}/visited"] > 0.0
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


def draw(path: Path, draws: int, first_seed: int, around: Around | None) -> None:
    """Append draws to a file, those that it does not hold yet."""
    held = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    known = {json.loads(line)["seed"] for line in held}
    for seed in range(first_seed, first_seed + draws):
        if seed in known:
            continue
        robot = drawn(np.random.default_rng([13, seed] if around is None else [13, seed, 1]), around)
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


@dataclass(frozen=True)
class Population:
    """Robots with what they did: (N, P) places in the unit cube, (N, S) summaries, (N,) weights."""

    places: FloatArray
    summaries: FloatArray
    weights: FloatArray

    @staticmethod
    def read(path: Path, around: Around | None = None) -> Population:
        """What a file holds; robots whose square never closed are infinitely far away."""
        lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        places = np.array([unit(line["robot"]) for line in lines])
        weights = np.ones(len(lines))
        if around is not None:
            weights = np.array([1.0 / max(around.density(place), 1e-300) for place in places])
        summaries = np.array([line["summary"] for line in lines], dtype=np.float64)
        return Population(places, summaries, weights / weights.sum())

    def distances(self, real_ones: FloatArray, scales: FloatArray) -> FloatArray:
        """(N,) root mean square over the summaries, each by its scale."""
        away = np.sqrt(np.square((self.summaries - real_ones) / scales).mean(axis=1))
        return np.where(np.isfinite(away), away, np.inf)

    def nearest(self, real_ones: FloatArray, scales: FloatArray, share: float) -> Population:
        """The nearest share."""
        away = self.distances(real_ones, scales)
        kept = np.argsort(away)[: max(10, round(share * len(away)))]
        weights = self.weights[kept]
        return Population(self.places[kept], self.summaries[kept], weights / weights.sum())

    def proposal(self) -> Around:
        """To draw around these: twice their variance."""
        mean = self.weights @ self.places
        var = self.weights @ np.square(self.places - mean)
        return Around(self.places, self.weights, np.sqrt(2.0 * var))


def scales_of(prior: Population) -> FloatArray:
    """(S,) median absolute deviations over the prior; where that is none, the standard deviation."""
    whole = prior.summaries[np.isfinite(prior.summaries).all(axis=1)]
    mad = 1.4826 * np.median(np.abs(whole - np.median(whole, axis=0)), axis=0)
    return np.where(mad > 0.0, mad, np.maximum(whole.std(axis=0), 1e-9))


def changes(population: Population, names: list[str]) -> dict[str, FloatArray]:
    """What fusing the heading changes for each robot, in percentage points; means over both avoidances."""

    def column(name: str, key: str) -> FloatArray:
        return population.summaries[:, names.index(f"{name} :: {key}")]

    pairs = (
        ("exploration", "exploration, fusion"),
        ("exploration, avoidance", "exploration, fusion, avoidance"),
    )
    covered = [column(fused, "visited") - column(plain, "visited") for plain, fused in pairs]
    right = [
        column(fused, "visited_right") / column(fused, "visited")
        - column(plain, "visited_right") / column(plain, "visited")
        for plain, fused in pairs
    ]
    rights = {
        f"visited right, {name}": 100.0 * column(name, "visited_right") / column(name, "visited")
        for name in ("exploration", "exploration, fusion")
    }
    return {
        "coverage by fusion": 100.0 / CELLS * np.mean(covered, axis=0),
        "visited right by fusion": 100.0 * np.mean(right, axis=0),
        **rights,
    }


def quantile(values: FloatArray, weights: FloatArray, share: float) -> float:
    """Weighted quantile."""
    order = np.argsort(values)
    return float(np.interp(share, np.cumsum(weights[order]), values[order]))


def fit(path: Path, first: Path | None, data: Path, out: Path | None) -> None:
    """Print the posterior and what its robots do; write both as values that pages quote."""
    real_ones = real(data)
    prior = Population.read(path if first is None else first)
    scales = scales_of(prior)
    around = None if first is None else prior.nearest(real_ones, scales, ACCEPTED).proposal()
    found = Population.read(path, around)
    kept = found.nearest(real_ones, scales, 0.5 if first else ACCEPTED)
    effective = 1.0 / float(np.square(kept.weights).sum())
    robots = [robot_of(place) for place in kept.places]
    values: dict[str, dict[str, float]] = {
        "robots :: prior": {"value": len(prior.places)},
        "robots :: drawn": {"value": len(found.places)},
        "robots :: kept": {"value": len(kept.places)},
        "robots :: effective": {"value": effective},
    }
    print(f"{len(kept.places)} of {len(found.places)} kept, worth {effective:.0f} of equal weight")
    for name, (kind, low, high) in PARAMETERS.items():
        own = np.array([robot[name] for robot in robots])
        if kind == "switch":
            share = float(kept.weights @ own)
            values[name] = {"value": share, "n": len(own)}
            print(f"{name:>24}: on with probability {share:.2f}")
            continue
        middle, least, most = (quantile(own, kept.weights, q) for q in (0.5, 0.025, 0.975))
        values[name] = {"value": middle, "low": least, "high": most, "n": len(own)}
        print(f"{name:>24}: {middle:.3g} ({least:.3g} to {most:.3g}; prior {low:g} to {high:g})")
    names = [f"{name} :: {key}" for name in CONFIGURATIONS for key in KEYS] + [
        f"film :: {k}" for k in FILM_KEYS
    ]
    for index, name in enumerate(names):
        own = kept.summaries[:, index]
        middle, least, most = (quantile(own, kept.weights, q) for q in (0.5, 0.025, 0.975))
        values[name] = {"value": middle, "low": least, "high": most, "real": float(real_ones[index])}
        mark = "" if least <= real_ones[index] <= most else "  OUTSIDE"
        print(f"{name:>48}: {middle:.3g} ({least:.3g} to {most:.3g}), real {real_ones[index]:.3g}{mark}")
    for who, population in (("prior", prior), ("kept", kept)):
        for what, found_changes in changes(population, names).items():
            spread = summarize(found_changes)
            values[f"{who} :: {what}"] = {
                "value": spread.mean,
                "low": spread.low,
                "high": spread.high,
                "n": spread.n,
                "at_least_15": float((found_changes >= 15.0).mean()),
                "smallest": float(np.quantile(found_changes, 0.025)),
                "largest": float(np.quantile(found_changes, 0.975)),
            }
            print(
                f"{who}, {what}: {spread.mean:.1f} ({spread.low:.1f} to {spread.high:.1f}), n {spread.n}; "
                f"single robots {values[f'{who} :: {what}']['smallest']:.1f} to "
                f"{values[f'{who} :: {what}']['largest']:.1f}"
            )
    if out is not None:
        out.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def main() -> int:
    """Draw or fit."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("draw", "fit", "both"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--around", type=Path)
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.what == "fit":
        fit(options.file, options.around, options.data, options.json)
        return 0
    around = None
    if options.around is not None:
        prior, real_ones = Population.read(options.around), real(options.data)
        around = prior.nearest(real_ones, scales_of(prior), ACCEPTED).proposal()
    draw(options.file, options.draws, options.first_seed, around)
    if options.what == "both":
        fit(options.file, options.around, options.data, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
