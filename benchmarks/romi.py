"""The exploration report's five configurations, many trials each, beside its single ones.

    python -m benchmarks.romi [--seeds 30] [--json FILE]

Trial ``i`` of every configuration has seed ``i``: the same robot with the same errors, so that switches are
compared pair by pair. Exit code 0 where the baseline covers less than every exploration and every
trial ends with a reason. Takes about five minutes for 30 seeds on one core.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import summarize
from pilotage.evaluation.paired import corrected, difference
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

EXPLORER = "stack.navigator.name=surround-check"
ALWAYS = "stack.navigator.avoid=always"
TRUNCATED = "stack.navigator.firmware.truncated_wheel_speed=true"
CENTRE = "stack.navigator.firmware.lines_at_centre=true"
LATE = "stack.navigator.firmware.pose_period_s=0.05"


@dataclass(frozen=True)
class Configuration:
    """A mission, what is set in it, and what the report's one trial visited of it (%)."""

    name: str
    mission: str
    overrides: tuple[str, ...]
    reported: float = np.nan


def _exploration(
    name: str, fusion: bool, avoidance: bool, reported: float = np.nan, *more: str
) -> Configuration:
    given = {"fusion": fusion, "avoidance": avoidance}
    switches = tuple(f"stack.navigator.{key}={str(value).lower()}" for key, value in given.items())
    return Configuration(name, "romi-explore", (EXPLORER, *switches, *more), reported)


BASELINE = Configuration("baseline", "romi-baseline", (), 11.0)
EXPLORATIONS = (
    _exploration("NoOA-NoSF", False, False, 16.3),
    _exploration("YesOA-NoSF", False, True, 21.3),
    _exploration("YesOA-YesSF", True, True, 29.1),
    _exploration("NoOA-YesSF", True, False, 39.2),
)
FURTHER = (
    _exploration("OA always, NoSF", False, True, np.nan, ALWAYS),
    _exploration("OA always, YesSF", True, True, np.nan, ALWAYS),
    _exploration("NoOA-YesSF, whole rad/s", True, False, np.nan, TRUNCATED),
    _exploration("NoOA-YesSF, pose at 20 Hz", True, False, np.nan, LATE),
    _exploration("NoOA-YesSF, lines at centre", True, False, np.nan, CENTRE),
    _exploration("NoOA-YesSF, all faults", True, False, np.nan, TRUNCATED, LATE, CENTRE),
)
SWITCHES = (
    ("exploration, plain", "baseline", "NoOA-NoSF"),
    ("fusion, no avoidance", "NoOA-NoSF", "NoOA-YesSF"),
    ("fusion, with avoidance", "YesOA-NoSF", "YesOA-YesSF"),
    ("avoidance, no fusion", "NoOA-NoSF", "YesOA-NoSF"),
    ("avoidance, with fusion", "NoOA-YesSF", "YesOA-YesSF"),
    ("always on for far hops, no fusion", "YesOA-NoSF", "OA always, NoSF"),
    ("always on for far hops, fusion", "YesOA-YesSF", "OA always, YesSF"),
    ("wheel speeds in whole rad/s", "NoOA-YesSF", "NoOA-YesSF, whole rad/s"),
    ("pose at 20 Hz", "NoOA-YesSF", "NoOA-YesSF, pose at 20 Hz"),
    ("lines marked at the centre", "NoOA-YesSF", "NoOA-YesSF, lines at centre"),
    ("all three faults", "NoOA-YesSF", "NoOA-YesSF, all faults"),
)
CHANGES = (
    ("coverage_visited", "visited", 100.0),
    ("visited_accuracy", "visited right", 100.0),
    ("feature_precision", "features right", 100.0),
    ("position_rmse_m", "pose RMSE, mm", 1000.0),
    ("hit", "hit a box", 100.0),
)
SHOWN = (
    ("coverage_visited", "visited %", 100.0),
    ("coverage_reachable", "of reachable %", 100.0),
    ("visited_accuracy", "visited right %", 100.0),
    ("feature_precision", "features right %", 100.0),
    ("feature_recall", "features found %", 100.0),
    ("free_accuracy", "free right %", 100.0),
    ("explored_accuracy", "explored right %", 100.0),
    ("position_rmse_m", "pose RMSE mm", 1000.0),
    ("duration_s", "duration s", 1.0),
)

Trials = list[dict[str, object]]


def run_all(configurations: tuple[Configuration, ...], seeds: int) -> dict[str, Trials]:
    """Every configuration with seeds 0 .. seeds - 1."""
    found: dict[str, Trials] = {}
    for configuration in configurations:
        trials = []
        for seed in range(seeds):
            mission = load_mission(configuration.mission, configuration.overrides, seed)
            metrics = run_mission(mission, save=False).metrics
            trials.append(metrics | {"hit": float(metrics["collisions"] != 0)})
        found[configuration.name] = trials
        print(f"{configuration.name}: {len(trials)} trials", file=sys.stderr)
    return found


def values(trials: Trials, key: str) -> FloatArray:
    """One metric of every trial, nan where it has none."""
    return np.array([np.nan if trial.get(key) is None else float(str(trial[key])) for trial in trials])


def table_of_trials(configurations: tuple[Configuration, ...], found: dict[str, Trials]) -> Table:
    """Means with their 95 % intervals, and why trials ended."""
    table = Table(title="mean [95 % interval]")
    for heading in ("", "report %", *(name for _, name, _ in SHOWN), "hit a box", "ends"):
        table.add_column(heading)
    for configuration in configurations:
        trials = found[configuration.name]
        cells = []
        for key, _, factor in SHOWN:
            s = summarize(factor * values(trials, key))
            cells.append(f"{s.mean:.1f} [{s.low:.1f}, {s.high:.1f}]")
        ends = Counter(str(trial["reason"]).split("; touched")[0] for trial in trials)
        table.add_row(
            configuration.name,
            f"{configuration.reported:g}",
            *cells,
            f"{int(values(trials, 'hit').sum())}/{len(trials)}",
            ", ".join(f"{count} {reason}" for reason, count in ends.most_common()),
        )
    return table


def table_of_switches(found: dict[str, Trials]) -> Table:
    """What each switch changes, pair by pair; stars where p, corrected over the table, is below 0.05."""
    table = Table(title="change by each switch, mean of pairs [95 % interval]; * p < 0.05, corrected")
    for heading in ("switch", *(name for _, name, _ in CHANGES)):
        table.add_column(heading)
    rows = [
        [
            difference(f * values(found[a], key), f * values(found[b], key), binary=key == "hit")
            for key, _, f in CHANGES
        ]
        for _, a, b in SWITCHES
    ]
    p_values = iter(corrected([cell.p_value for row in rows for cell in row]))
    for (name, _, _), row in zip(SWITCHES, rows, strict=True):
        cells = []
        for cell in row:
            star = " *" if next(p_values) < 0.05 else ""
            cells.append(f"{cell.mean:+.1f} [{cell.low:+.1f}, {cell.high:+.1f}]{star}")
        table.add_row(name, *cells)
    return table


def main() -> int:
    """Run and print; 1 where a bar is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--json", type=Path, help="keep every trial's metrics in this file")
    arguments = parser.parse_args()
    configurations = (BASELINE, *EXPLORATIONS, *FURTHER)
    found = run_all(configurations, arguments.seeds)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    console = Console(width=230)
    console.print(table_of_trials(configurations, found))
    console.print(table_of_switches(found))
    mean = {name: float(values(trials, "coverage_visited").mean()) for name, trials in found.items()}
    below = all(mean["baseline"] < mean[configuration.name] for configuration in EXPLORATIONS)
    reasons = all(trial["reason"] for trials in found.values() for trial in trials)
    speed = min(float(np.median(values(trials, "real_time_factor"))) for trials in found.values())
    console.print(f"baseline below every exploration: {below}; every trial ends with a reason: {reasons}")
    console.print(f"slowest configuration: {speed:.0f} x real time (median of its trials)")
    return 0 if below and reasons else 1


if __name__ == "__main__":
    sys.exit(main())
