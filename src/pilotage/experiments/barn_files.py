"""What a BARN benchmark leaves: a row a run, the numbers, and run folders of the worst runs."""

from __future__ import annotations

import json
import math
from pathlib import Path

from pilotage.core.whole_file import write_whole
from pilotage.experiments.barn_benchmark import BarnAnswer, replay_missions, summary_values
from pilotage.experiments.result_rows import write_rows
from pilotage.experiments.run import run_mission

SUMMARY, REPLAYS = "summary.json", "replays"
COLUMNS = (
    "controller",
    "world",
    "trial",
    "success",
    "collision",
    "timeout",
    "time_s",
    "optimal_time_s",
    "bound_s",
    "metric",
)


def write_barn(answer: BarnAnswer, folder: Path, replays: int) -> dict[tuple[str, int, int], Path]:
    """Write rows and numbers into a folder, and drive the worst runs of each controller once more.

    Returns
    -------
    Run folders by controller, world and trial.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = [
        (
            name,
            run.world,
            run.trial,
            int(run.success),
            int(run.collision),
            int(run.timeout),
            run.time_s,
            run.optimal_time_s,
            run.bound_s,
            run.metric,
        )
        for name, runs in answer.runs.items()
        for run in runs
    ]
    write_rows(folder, COLUMNS, rows)
    values = {
        "controllers": list(answer.request.controllers),
        "trials": answer.request.trials,
        "seed": answer.request.seed,
        "overrides": list(answer.request.overrides),
        "without_way": list(answer.without_way),
        "result": finite(summary_values(answer)),
    }
    write_whole(folder / SUMMARY, json.dumps(values, indent=1, allow_nan=False) + "\n")
    made: dict[tuple[str, int, int], Path] = {}
    for name in answer.request.controllers:
        for run, mission in replay_missions(answer, name, replays):
            result = run_mission(mission, out=folder / REPLAYS)
            assert result.run_dir is not None, "it is saved"
            made[name, run.world, run.trial] = result.run_dir
    return made


def finite(value: object) -> object:
    """The same with None for what JSON has no number for: the time of runs of which none succeeded."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
