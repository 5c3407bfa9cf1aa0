"""Record the golden runs anew: run this file after a change of behaviour that is meant."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pilotage.experiments.floor.mission import load_floor_mission
from pilotage.experiments.floor.simulate import simulate

RUNS: dict[str, tuple[str, list[str], int]] = {
    "route": ("museum-route", ["run.time_limit_s=30"], 1),
    "hall": ("museum-hall", [], 2),
    "dead-reckoning": ("museum-route", ["run.time_limit_s=10", "stack.localizer.name=dead-reckoning"], 3),
}
COLUMNS = (
    "true_x_m",
    "true_y_m",
    "true_theta_rad",
    "est_x_m",
    "est_y_m",
    "est_theta_rad",
    "cov_xx_m2",
    "clearance_m",
)


def recorded(mission: str, overrides: list[str], seed: int) -> dict[str, Any]:
    """A few rows of one run."""
    record = simulate(load_floor_mission(mission, overrides, seed))
    steps = record.trace["t_s"].shape[0]
    rows = {
        str(step): {column: float(record.trace[column][step]) for column in COLUMNS}
        for step in (0, steps // 3, steps - 1)
    }
    return {
        "mission": mission,
        "overrides": overrides,
        "seed": seed,
        "arrived": record.outcome.arrived,
        "steps": steps,
        "rows": rows,
    }


if __name__ == "__main__":
    text = json.dumps({name: recorded(*run) for name, run in RUNS.items()}, indent=1)
    (Path(__file__).parent / "recorded_runs.json").write_text(text + "\n")
