"""What each module costs: the mission with one oracle at a time, on the same seeds."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.plugins import is_from_outside
from pilotage.core.types import FloatArray
from pilotage.evaluation.judge import SUCCESS, Judgement, judge
from pilotage.evaluation.metric import Aspect, Metric
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.paired import Difference
from pilotage.evaluation.tasks.task import TASKS
from pilotage.experiments.given import has
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.oracles.applicable import applicable
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.sweep import settings_of
from pilotage.experiments.studies.table import StudyTable, read_study

FIRST = 0
"""The cell of the mission as it is."""
DRIVER = "driver"
"""An oracle that stands in for no module: it drives, and the localizer is only judged."""
BASELINE = "as it is"
ORACLE = "oracle "
SURE = 0.05
RANKED = ({Aspect.ACCURACY}, {Aspect.SAFETY}, {Aspect.TIME, Aspect.EFFORT})
"""After success; what a gain speaks of."""


def attribution_study(mission: str, overrides: Sequence[str], trials: int) -> Study:
    """A study with one configuration an oracle, and the mission as it is as the baseline.

    Oracles that the mission has already stay in all of them.

    Raises
    ------
    InputError
        Where the mission has no module that an oracle can replace.
    """
    loaded = load_mission(mission, overrides)
    own = loaded.run.oracles
    oracles = {name: text for name, text in applicable(loaded).items() if name not in (DRIVER, *own)}
    there = has(loaded)
    if "estimate" in there and "settled" not in there:
        raise InputError(
            f"attribute '{mission}': expected a run.time_limit_s above run.settle_s "
            f"({loaded.run.settle_s:g} s), after which errors count, found {loaded.run.time_limit_s:g}"
        )
    costs = METRICS.costs_of(loaded.task.name, METRICS.given_by(loaded.task.name, there))
    if not oracles:
        raise InputError(f"attribute '{mission}': expected a mission with modules that an oracle can replace")
    configurations: list[dict[str, Any]] = [{"name": BASELINE, "set": {"run.oracles": list(own)}}]
    configurations += [{"name": f"{ORACLE}{name}", "set": {"run.oracles": [*own, name]}} for name in oracles]
    named = Path(mission).stem
    changed = f" (with {', '.join(overrides)})" if overrides else ""
    values: dict[str, Any] = {
        "study": _name(mission, overrides),
        "question": f"What does each module of '{named}'{changed} cost, beside one that knows all?",
        "mission": mission,
        "set": settings_of(overrides),
        "configurations": configurations,
        "trials": trials,
        "baseline": BASELINE,
    }
    # Which metrics runs of a stranger's task give shows when they do: then all of those are reported.
    if not is_from_outside(TASKS.entry(loaded.task.name).factory.__module__):
        values["metrics"] = [metric.key for metric in costs]
        values |= {"primary": costs[0].key, "lower_is_better": costs[0].less_is_better}
    return make_study(validate(StudyDefinition, values, ""))


def _name(mission: str, overrides: Sequence[str]) -> str:
    """Another name for other overrides: their trials are not the same study's."""
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in Path(mission).stem)
    digest = hashlib.sha256(json.dumps(list(overrides)).encode()).hexdigest()[:6]
    return f"attribute-{stem}-{digest}" if overrides else f"attribute-{stem}"


def is_attribution(study: Study) -> bool:
    """Whether a study holds a mission as it is beside oracles, one at a time."""
    first, *others = (cell.name for cell in study.cells)
    return first == BASELINE and bool(others) and all(name.startswith(ORACLE) for name in others)


def attribution_of(folder: Path) -> dict[str, Any]:
    """Rank the modules by what their oracles gain.

    Returns
    -------
    ``modules``, most costly first: for each what its oracle does, the change of every metric with its
    interval and whether it is for the better, and sentences on those that differ surely, or else may differ.
    Success counts before accuracy (errors, coverage), that before safety and time; among them the share that
    is gained. What an oracle makes worse is no cost of its module: it is told, and counts nothing, but for
    success. Times and paths are compared on the seeds where both runs succeeded.
    """
    table = read_study(folder)
    base = mission_of(dict(table.study.base), table.study.cells[FIRST].overrides)
    texts = applicable(base)
    judging = METRICS.costs_of(base.task.name, METRICS.given_by(base.task.name, has(base)))
    costs = {metric.key: metric for metric in (METRICS.find(SUCCESS), *_ranked(judging))}
    values = {name: table.comparable(name) for name in costs if name in table.values}
    judgement = judge(table.cell, table.trial, values, [FIRST] * len(table.study.cells))
    before = _baseline(judgement, FIRST)
    ranked: list[tuple[tuple[float, ...], dict[str, Any]]] = []
    for cell in table.study.cells[1:]:
        changes = {
            name: found
            for name in values
            if (found := judgement.differences[name][cell.index]) is not None and found.n
        }
        sure = {name: _is_sure(table, values[name], cell.index, change) for name, change in changes.items()}
        entry = {
            "module": cell.name.removeprefix(ORACLE),
            "oracle": texts.get(cell.name.removeprefix(ORACLE), ""),
            "changes": {name: _plain(change, costs[name], sure[name]) for name, change in changes.items()},
            "told": _told(changes, costs, sure),
        }
        ranked.append((_weight(changes, costs, sure, before), entry))
    ranked.sort(key=lambda pair: pair[0], reverse=True)
    return {
        "attribution": table.study.base.get("mission", table.study.definition.mission),
        "trials": table.study.definition.trials,
        "baseline": before,
        "modules": [entry for _, entry in ranked],
        "study_dir": str(folder),
    }


def _ranked(costs: Sequence[Metric]) -> list[Metric]:
    """Costs in the order in which they count."""
    rank = {aspect: place for place, aspects in enumerate(RANKED) for aspect in aspects}
    return sorted(costs, key=lambda cost: rank.get(cost.aspect, len(RANKED)))


def _is_sure(table: StudyTable, values: FloatArray, cell: int, change: Difference) -> bool:
    """Whether chance does not explain a change: by its test, or because there is no chance in either cell."""
    if math.isfinite(change.p_corrected) and change.p_corrected < SURE:
        return True
    return (
        change.n > 1
        and change.mean != 0.0
        and all(
            np.ptp(column[np.isfinite(column)]) == 0.0 and len(set(table.seed[table.cell == index])) > 1
            for index in (FIRST, cell)
            if (column := values[table.cell == index]).size
        )
    )


def _weight(
    changes: Mapping[str, Difference],
    costs: Mapping[str, Metric],
    sure: Mapping[str, bool],
    before: Mapping[str, float],
) -> tuple[float, ...]:
    """Gains in success and, by aspect, the greatest share gained: the sure ones first, then what may be."""

    def gains(counted: Mapping[str, bool]) -> tuple[float, ...]:
        won = changes[SUCCESS].mean if counted.get(SUCCESS, False) else 0.0
        by_aspect = (
            max(
                (
                    _share(change.mean, costs[name], before.get(name, math.nan))
                    for name, change in changes.items()
                    if costs[name].aspect in aspects and counted[name] and name != SUCCESS
                ),
                default=0.0,
            )
            for aspects in RANKED
        )
        return (won, *by_aspect)

    return (*gains(sure), *gains({name: _may_differ(change) for name, change in changes.items()}))


def _may_differ(change: Difference) -> bool:
    """Whether the interval of the change leaves zero out."""
    return change.low > 0.0 or change.high < 0.0


def _share(change: float, cost: Metric, before: float) -> float:
    """What is gained, as a share of what there was; of a metric that is a share itself, in its own points."""
    whole = 1.0 if cost.unit == "share" else abs(before)
    return max(_gain(change, cost) / whole, 0.0) if whole > 0.0 else 0.0


def _gain(change: float, cost: Metric) -> float:
    return -change if cost.less_is_better else change


def _told(
    changes: Mapping[str, Difference], costs: Mapping[str, Metric], sure: Mapping[str, bool]
) -> list[str]:
    """What differs surely; where nothing does, what may: its interval leaves zero out. Gains first."""
    known = [name for name in changes if sure[name]]
    word = "" if known else "perhaps "
    known = known or [name for name, change in changes.items() if _may_differ(change)]
    gains = [name for name in known if _gain(changes[name].mean, costs[name]) > 0.0]
    losses = [name for name in known if name not in gains]
    return [
        *(f"{word}{name} {_change(changes[name])}" for name in gains),
        *(f"{word}worse: {name} {_change(changes[name])}" for name in losses),
    ]


def _change(change: Difference) -> str:
    if change.low == change.high:
        return f"{_signed(change.mean)} in every trial"
    return f"{_signed(change.mean)} ({_signed(change.low)} to {_signed(change.high)})"


def _signed(value: float) -> str:
    """Four digits that count, without an exponent for what people measure."""
    return f"{float(f'{value:.4g}'):+.10g}" if 1e-4 <= abs(value) < 1e10 else f"{value:+.3g}"


def _baseline(judgement: Judgement, cell: int) -> dict[str, float]:
    """Means of the mission as it is."""
    return {
        name: summaries[cell].mean
        for name, summaries in judgement.summaries.items()
        if math.isfinite(summaries[cell].mean)
    }


def _plain(change: Difference, cost: Metric, sure: bool) -> dict[str, float | bool]:
    return {
        "n": change.n,
        "mean": change.mean,
        "low": change.low,
        "high": change.high,
        "median": change.median,
        "p": change.p_corrected,
        "effect": change.effect,
        "better": _gain(change.mean, cost) > 0.0,
        "sure": sure,
    }
