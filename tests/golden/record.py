"""Record the golden runs anew: run this file after a change of behaviour that is meant."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

RUNS: dict[str, tuple[str, list[str], int]] = {
    "route": ("museum-route", ["run.time_limit_s=30"], 1),
    "hall": ("museum-hall", [], 2),
    "dead-reckoning": ("museum-route", ["run.time_limit_s=10", "stack.localizer.name=dead-reckoning"], 3),
    "plan": ("museum-plan", ["stack.planner.stop=first"], 4),
    "gale": ("gale-ekf", ["run.time_limit_s=20000", "world.goal.x_m=42000", "world.goal.y_m=12000"], 5),
    "romi": ("romi-explore", ["run.time_limit_s=30"], 6),
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
    finished = simulate(load_mission(mission, overrides, seed)).finished
    (robot,) = finished.robots
    steps = robot.trace["t_s"].shape[0]
    rows = {
        str(step): {column: float(robot.trace[column][step]) for column in COLUMNS}
        for step in ((0, steps // 3, steps - 1) if steps else ())
    }
    return {
        "mission": mission,
        "overrides": overrides,
        "seed": seed,
        "arrived": robot.arrived,
        "steps": finished.steps,
        "recorded": steps,
        "planned_m": [plan.length_m for plan in robot.plans],
        "rows": rows,
    }


if __name__ == "__main__":
    text = json.dumps({name: recorded(*run) for name, run in RUNS.items()}, indent=1)
    (Path(__file__).parent / "recorded_runs.json").write_text(text + "\n")
