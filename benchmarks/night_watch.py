"""The night watch's claims, measured: each mission over many seeds, beside the bar that it must clear.

    python -m benchmarks.night_watch [--seeds 50]

Exit code 0 where every bar is cleared. Takes about a minute for 50 seeds on one core.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pilotage.evaluation.run_metrics import run_metrics
from rich.console import Console
from rich.table import Table

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import fraction_in_band
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

MISSIONS = ("museum-1", "museum-2", "museum-route", "museum-concave", "museum-hall")
SETTLE_STEPS = 10


@dataclass(frozen=True)
class Sample:
    """Metrics and NEES series of one mission over its seeds."""

    metrics: list[dict[str, object]]
    nees: list[FloatArray]

    def values(self, key: str) -> FloatArray:
        """One metric of every run that has it."""
        return np.array([float(m[key]) for m in self.metrics if m.get(key) is not None])  # type: ignore[arg-type]

    def band_share(self) -> float:
        """Share of steps whose mean NEES over the runs lies in its pointwise 99.9 % band."""
        # Steps that fewer than all runs reach are judged by those that do.
        steps = max(series.shape[0] for series in self.nees)
        inside = []
        for k in range(SETTLE_STEPS, steps):
            column = np.array([series[k] for series in self.nees if series.shape[0] > k])
            if column.shape[0] >= 10:
                inside.append(fraction_in_band(column[:, None], 3, 0.999))
        return float(np.mean(inside))


def sample(mission: str, seeds: int) -> Sample:
    """Run a mission with seeds 0 .. seeds - 1."""
    metrics, series = [], []
    simulate(load_mission(mission, seed=0))  # compiles
    for seed in range(seeds):
        config = load_mission(mission, seed=seed)
        record = simulate(config)
        found, nees = run_metrics(config, record.trace, record.outcome, record.experiment.floor.walls)
        metrics.append(found)
        series.append(nees)
    return Sample(metrics, series)


@dataclass(frozen=True)
class Claim:
    """One measured number and its bar."""

    mission: str
    what: str
    measure: Callable[[Sample], float]
    bar: float
    at_least: bool

    def holds(self, value: float) -> bool:
        """Whether the bar is cleared."""
        return value >= self.bar if self.at_least else value <= self.bar


def claims(seeds: int) -> list[Claim]:
    """What must hold, mission by mission; counts are scaled to the number of seeds."""
    rows: list[Claim] = []
    for mission, misses in (("museum-1", 1), ("museum-2", 1), ("museum-concave", 2), ("museum-hall", 0)):
        most = seeds - misses * seeds // 50
        rows.append(Claim(mission, "runs that succeed", lambda s: s.values("success").sum(), most, True))
    rows += [
        Claim(mission, "collisions", lambda s: s.values("collisions").sum(), 0, False) for mission in MISSIONS
    ]
    for mission in ("museum-1", "museum-2"):
        rows += [
            Claim(mission, "RMSE median [m]", lambda s: np.median(s.values("position_rmse_m")), 0.02, False),
            Claim(
                mission,
                "max error, 95 % [m]",
                lambda s: np.quantile(s.values("position_max_m"), 0.95),
                0.1,
                False,
            ),
            Claim(mission, "plan over shortest, worst", _length_ratio, 1.05, False),
            Claim(
                mission, "planning time, worst [s]", lambda s: s.values("planning_time_s").max(), 1.0, False
            ),
            Claim(
                mission, "first solution, worst [s]", lambda s: s.values("first_solution_s").max(), 0.1, False
            ),
            Claim(mission, "NEES steps in 99.9 % band", Sample.band_share, 0.95, True),
        ]
    route = "museum-route"
    rows += [
        Claim(route, "RMSE median [m]", lambda s: np.median(s.values("position_rmse_m")), 0.008, False),
        Claim(route, "RMSE, 95 % [m]", lambda s: np.quantile(s.values("position_rmse_m"), 0.95), 0.01, False),
        Claim(route, "NEES steps in 99.9 % band", Sample.band_share, 0.95, True),
        Claim(route, "mean NEES, at least", lambda s: s.values("nees_mean").mean(), 2.7, True),
        Claim(route, "mean NEES, at most", lambda s: s.values("nees_mean").mean(), 3.3, False),
        Claim(route, "|mean NIS - 1|", lambda s: abs(s.values("nis_mean").mean() - 1.0), 0.1, False),
        Claim(
            "museum-hall", "off the middle, worst [m]", lambda s: s.values("hall_offset_m").max(), 0.05, False
        ),
        Claim("museum-1", "control steps a second", lambda s: np.median(s.values("steps_per_s")), 5000, True),
    ]
    return rows


def _length_ratio(s: Sample) -> float:
    return float((s.values("planned_length_m") / s.values("shortest_length_m")).max())


def main() -> int:
    """Measure everything and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=50)
    seeds = parser.parse_args().seeds
    samples = {mission: sample(mission, seeds) for mission in MISSIONS}
    table = Table(title=f"The night watch over {seeds} seeds a mission")
    for heading in ("mission", "what", "measured", "bar", ""):
        table.add_column(heading, justify="right" if heading in ("measured", "bar") else "left")
    missed = 0
    for claim in claims(seeds):
        value = float(claim.measure(samples[claim.mission]))
        holds = claim.holds(value)
        missed += not holds
        sign = ">=" if claim.at_least else "<="
        table.add_row(
            claim.mission, claim.what, f"{value:.5g}", f"{sign} {claim.bar:g}", "yes" if holds else "NO"
        )
    Console().print(table)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
