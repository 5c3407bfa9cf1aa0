"""A study's rows as columns, for judging, pages and other programs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.judge import SUCCESS, Judgement, judge
from pilotage.evaluation.metric import Aspect
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.pooled import IDEALS
from pilotage.experiments.mission import mission_of
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.export import save_what_is_left
from pilotage.experiments.studies.groups import CellGroup, baselines, cell_groups
from pilotage.experiments.studies.rows import flat, read_rows
from pilotage.experiments.studies.study import Study, load_study

IDENTITY = frozenset({"seed"})
"""Numbers of a trial that say which one it is."""


@dataclass(frozen=True, slots=True)
class StudyTable:
    """The finished trials of a study as columns.

    Attributes
    ----------
    row, cell, trial, seed
        (n,) of the trials that are done.
    values
        By metric, (n,): nan where a trial does not give it.
    broken
        Rows that failed: (row, cell, seed, reason).
    waiting
        How many are still to run.
    """

    study: Study
    folder: Path
    row: IntArray
    cell: IntArray
    trial: IntArray
    seed: IntArray
    values: Mapping[str, FloatArray]
    broken: tuple[tuple[int, int, int, str], ...]
    waiting: int

    @property
    def metrics(self) -> tuple[str, ...]:
        """What is reported: what the definition asks for, else every number that varies or matters."""
        asked = self.study.definition.metrics
        given = [name for name in self.values if name not in {*IDENTITY, SUCCESS}]
        if asked:
            return asked
        mission = mission_of(dict(self.study.base), self.study.cells[0].overrides)
        costs = METRICS.costs_of(mission.task.name, given)
        # Where nothing is asked for, accuracy answers before time does.
        judging = sorted(costs, key=lambda metric: metric.aspect is not Aspect.ACCURACY)
        first = dict.fromkeys([*(metric.key for metric in judging), *(m for m in IDEALS if m in given)])
        return (*first, *(m for m in given if m not in first))

    @property
    def primary(self) -> str:
        """The metric that answers the question."""
        return self.study.definition.primary or next(iter(self.metrics), SUCCESS)

    @property
    def same_seeds(self) -> bool:
        """Whether trials with the same number in two cells share a seed."""
        return self.study.definition.seeds.pairing == "shared"

    @property
    def groups(self) -> tuple[CellGroup, ...]:
        """Cells that are judged together, with the one that the others are held against."""
        return cell_groups(self.study.definition, self.study.cells)

    @property
    def contrasts(self) -> tuple[tuple[str, str], ...]:
        """Pairs of metrics that are held against each other within every trial."""
        return tuple((entry.metric, entry.against) for entry in self.study.definition.contrasts)

    def judged(self) -> Judgement:
        """Every cell's summary, and every cell against its baseline."""
        names = dict.fromkeys([*self.metrics, self.primary, SUCCESS])
        empty = np.full(self.row.shape, math.nan)
        values = {name: self.values.get(name, empty) for name in names}
        held_against = baselines(self.groups, len(self.study.cells))
        return judge(self.cell, self.trial, values, held_against, self.contrasts, same_seeds=self.same_seeds)


def read_study(folder: Path) -> StudyTable:
    """Read a study's folder; also while it runs.

    Raises
    ------
    InputError
        Where it is no study's folder, or its database is corrupt: what can be read of it is then beside
        it, in ``trials-salvaged.csv``.
    """
    study = load_study(str(folder))
    rows, trouble = read_rows(folder / DATABASE)
    if trouble:
        raise save_what_is_left(folder, study, trouble)
    done = [row for row in rows if row["status"] == "done"]
    numbers = [flat(row["metrics"]) | flat(row["timings"]) for row in done]
    names = sorted({name for row in numbers for name in row})
    values = {name: np.array([row.get(name, math.nan) for row in numbers]) for name in names}
    broken = tuple(
        (row["row"], row["cell"], row["seed"], row["reason"]) for row in rows if row["status"] == "failed"
    )

    def column(key: str) -> IntArray:
        return np.array([row[key] for row in done], dtype=np.int64)

    waiting = len(rows) - len(done) - len(broken)
    return StudyTable(
        study,
        folder,
        column("row"),
        column("cell"),
        column("trial"),
        column("seed"),
        values,
        broken,
        waiting,
    )


def study_object(table: StudyTable) -> dict[str, Any]:
    """The study's JSON object: counts, and one object a cell."""
    judgement = table.judged()
    cells = []
    for cell in table.study.cells:
        rate = judgement.rates[cell.index]
        metrics = {}
        for name in table.metrics:
            found = judgement.summaries[name][cell.index]
            metrics[name] = {
                "n": found.n,
                "mean": found.mean,
                "median": found.median,
                "low": found.low,
                "high": found.high,
                "variance": found.variance,
            }
        cells.append(
            {
                "name": cell.name,
                "values": dict(cell.values),
                "success": {
                    "n": rate.trials,
                    "mean": rate.successes / rate.trials if rate.trials else None,
                    "low": rate.low,
                    "high": rate.high,
                },
                "metrics": metrics,
                **({"published": dict(cell.published)} if cell.published else {}),
            }
        )
    return {
        "study": table.study.name,
        "mission": table.study.base.get("mission", table.study.definition.mission),
        "trials": len(table.row) + len(table.broken),
        "failed": len(table.broken),
        "missing": table.waiting,
        "primary": table.primary,
        "cells": cells,
        "study_dir": str(table.folder),
    }
