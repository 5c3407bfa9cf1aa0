"""What each module costs: the mission with one oracle at a time, on the same seeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.evaluation.judge import SUCCESS
from pilotage.evaluation.paired import Difference
from pilotage.experiments.kinds import kind_of
from pilotage.experiments.mission import load_mission
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.sweep import settings_of
from pilotage.experiments.studies.table import read_study

DRIVER = "driver"
"""An oracle that stands in for no module: it drives, and the localizer is only judged."""
BASELINE = "as it is"
ASKED = (SUCCESS, "duration_s", "position_rmse_m", "path_length_m", "min_clearance_m", "coverage_reachable")
"""What is compared, as far as the mission gives it: success, time, accuracy."""
SURE = 0.05


def attribution_study(mission: str, overrides: Sequence[str], trials: int) -> Study:
    """A study with one configuration an oracle, and the mission as it is as the baseline.

    Raises
    ------
    InputError
        Where missions of this kind have no oracles.
    """
    loaded = load_mission(mission, overrides)
    oracles = kind_of(loaded).oracles(loaded)
    if not oracles:
        raise InputError(f"attribute '{mission}': expected a mission with modules that an oracle can replace")
    configurations: list[dict[str, Any]] = [{"name": BASELINE, "set": {"run.oracles": []}}]
    configurations += [
        {"name": f"oracle {name}", "set": {"run.oracles": [name]}} for name in oracles if name != DRIVER
    ]
    values: dict[str, Any] = {
        "study": f"attribute-{Path(mission).stem}",
        "question": f"What does each module of '{Path(mission).stem}' cost, beside one that knows all?",
        "mission": mission,
        "set": settings_of(overrides),
        "configurations": configurations,
        "trials": trials,
        "primary": "duration_s",
        "baseline": BASELINE,
    }
    return make_study(validate(StudyDefinition, values, ""))


def attribution_of(folder: Path) -> dict[str, Any]:
    """Rank the modules by what their oracles gain.

    Returns
    -------
    ``modules``, most costly first: for each the change of every metric with its interval, and sentences on
    those that differ surely. Success counts before accuracy, accuracy before time; among them the effect.
    """
    table = read_study(folder)
    judgement = table.judged()
    ranked: list[tuple[tuple[float, ...], dict[str, Any]]] = []
    for cell in table.study.cells[1:]:
        changes: dict[str, Difference] = {}
        for name in ASKED:
            found = judgement.differences[name][cell.index] if name in judgement.differences else None
            if found is not None:
                changes[name] = found
        entry = {
            "module": cell.name.removeprefix("oracle "),
            "changes": {name: _plain(change) for name, change in changes.items() if change.n},
            "told": [_told(name, change) for name, change in changes.items() if _sure(change)],
        }
        ranked.append((_weight(changes), entry))
    ranked.sort(key=lambda pair: pair[0], reverse=True)
    return {
        "attribution": table.study.base.get("mission", table.study.definition.mission),
        "trials": table.study.definition.trials,
        "modules": [entry for _, entry in ranked],
        "study_dir": str(folder),
    }


def _sure(change: Difference) -> bool:
    return change.n > 0 and math.isfinite(change.p_corrected) and change.p_corrected < SURE


def _weight(changes: dict[str, Difference]) -> tuple[float, ...]:
    """Sure gains in success, then in accuracy or coverage, then in time; then all effects together."""

    def gain(name: str, sign: float) -> float:
        change = changes.get(name)
        return sign * change.effect if change is not None and _sure(change) else 0.0

    success = changes.get(SUCCESS)
    won = success.mean if success is not None and _sure(success) else 0.0
    accuracy = max(gain("position_rmse_m", -1.0), gain("coverage_reachable", 1.0))
    total = sum(abs(change.effect) for change in changes.values() if math.isfinite(change.effect))
    return (won, accuracy, gain("duration_s", -1.0), total)


def _told(name: str, change: Difference) -> str:
    return f"{name} {change.mean:+.4g} ({change.low:+.4g} to {change.high:+.4g})"


def _plain(change: Difference) -> dict[str, float]:
    return {
        "n": change.n,
        "mean": change.mean,
        "low": change.low,
        "high": change.high,
        "median": change.median,
        "p": change.p_corrected,
        "effect": change.effect,
    }
