"""A study's rows as columns, for judging, pages and other programs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.plugins import PluginError
from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.endings import ending_of
from pilotage.evaluation.judge import SUCCESS, Judgement, judge
from pilotage.evaluation.metric import Aspect
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.pooled import IDEALS
from pilotage.experiments.mission import mission_of
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.export import save_what_is_left
from pilotage.experiments.studies.groups import CellGroup, baselines, cell_groups
from pilotage.experiments.studies.labels import unit_of
from pilotage.experiments.studies.rows import flat, read_rows
from pilotage.experiments.studies.study import Study, load_study

IDENTITY = frozenset({"seed"})
"""Numbers of a trial that say which one it is."""


@dataclass(frozen=True, slots=True)
class Broken:
    """A trial that gave no numbers."""

    row: int
    cell: int
    seed: int
    reason: str


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
        Rows that failed.
    waiting
        How many are still to run.
    ended
        Why each trial that is done ended, as ``evaluation.endings`` counts it.
    without
        Why a plugin that it ran with is not there; empty: all are. No trial can be run again then.
    """

    study: Study
    folder: Path
    row: IntArray
    cell: IntArray
    trial: IntArray
    seed: IntArray
    values: Mapping[str, FloatArray]
    broken: tuple[Broken, ...]
    waiting: int
    ended: tuple[str, ...] = ()
    without: str = ""

    @property
    def given(self) -> list[str]:
        """Every metric that some trial gives."""
        return [name for name in self.values if name not in {*IDENTITY, SUCCESS}]

    @property
    def telling(self) -> tuple[str, ...]:
        """The metrics that matter: what the definition asks for, else what judges the task."""
        if self.study.definition.metrics:
            return self.study.definition.metrics
        mission = mission_of(self.study.base, self.study.cells[0].overrides, recorded=True)
        costs = METRICS.costs_of(mission.task.name, self.given)
        # Where nothing is asked for, accuracy answers before time does.
        judging = sorted(costs, key=lambda metric: metric.aspect is not Aspect.ACCURACY)
        return (*(metric.key for metric in judging), *(name for name in IDEALS if name in self.given))

    @property
    def metrics(self) -> tuple[str, ...]:
        """What is reported: what the definition asks for, else every number, those that matter first."""
        asked = self.study.definition.metrics
        return asked or tuple(dict.fromkeys([*self.telling, *self.given]))

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The settings."""
        return self.study.cells

    @property
    def factors(self) -> tuple[str, ...]:
        """Names of what is varied."""
        return self.study.definition.factor_names

    def column(self, metric: str) -> FloatArray:
        """(n,) a metric's values; nan where there is none."""
        found = self.values.get(metric)
        return np.full(self.row.shape, math.nan) if found is None else found

    def unit(self, factor: str) -> str:
        """The unit of a factor's values; empty where it has none."""
        return unit_of(self.study.definition, factor)

    def members(self, group: CellGroup) -> list[Cell]:
        """The cells of a group."""
        return [self.cells[index] for index in group.cells]

    def known_as(self, index: int, group: CellGroup) -> str:
        """What a cell is called beside the cells of a group: its own name where it is none of them."""
        return self.cells[index].text if index in group.cells else self.cells[index].name

    def worth_showing(self, metric: str, cells: Iterable[Cell]) -> bool:
        """Whether the trials of some cells give a metric, and it varies or was asked for."""
        found = self.column(metric)[np.isin(self.cell, [cell.index for cell in cells])]
        found = found[np.isfinite(found)]
        if not found.size:
            return False
        asked = bool(self.study.definition.metrics) or metric == self.primary
        return asked or found.size == 1 or bool(np.ptp(found) > 0.0)

    @property
    def lower_is_better(self) -> bool:
        """Whether less of the primary metric is better; of one that has no direction, less comes first."""
        return self.less_is_better(self.primary) is not False

    def less_is_better(self, metric: str) -> bool | None:
        """Which way a metric is better here; None where neither is."""
        definition = self.study.definition
        if metric == self.primary and definition.lower_is_better is not None:
            return definition.lower_is_better
        return METRICS.find(metric).less_is_better

    def comparable(self, metric: str) -> FloatArray:
        """(n,) a metric's values; nan where there is none, or none of a whole run that it takes."""
        values = self.column(metric)
        success = self.values.get(SUCCESS)
        if success is None or not METRICS.find(metric).whole_runs:
            return values
        return np.where(success > 0.0, values, math.nan)

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
        values = {name: self.column(name) for name in names}
        held_against = baselines(self.groups, len(self.study.cells))
        return judge(self.cell, self.trial, values, held_against, self.contrasts, same_seeds=self.same_seeds)


def read_study(folder: Path) -> StudyTable:
    """Read a study's folder; also while it runs, and where its plugins are gone.

    Raises
    ------
    InputError
        Where it is no study's folder, or its database is corrupt: what can be read of it is then beside
        it, in ``trials-salvaged.csv``.
    """
    without = ""
    try:
        study = load_study(str(folder))
    except PluginError as error:
        study, without = load_study(str(folder), recorded=True), str(error)
    rows, trouble = read_rows(folder / DATABASE)
    if trouble:
        raise save_what_is_left(folder, study, trouble)
    for row in rows:
        if not 0 <= row["cell"] < len(study.cells):
            raise InputError(
                f"{folder}: expected trials of the {len(study.cells)} settings of study.yaml, found row "
                f"{row['row']} of setting {row['cell']}: is it the definition that they were run by?"
            )
    done = [row for row in rows if row["status"] == "done"]
    numbers = [flat(row["metrics"]) | flat(row["timings"]) for row in done]
    names = sorted({name for row in numbers for name in row})
    values = {name: np.array([row.get(name, math.nan) for row in numbers]) for name in names}
    failed = [row for row in rows if row["status"] == "failed"]
    broken = tuple(Broken(row["row"], row["cell"], row["seed"], row["reason"]) for row in failed)

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
        tuple(ending_of(row["metrics"]) for row in done),
        without,
    )
