"""The metrics that a study asks for: refused as soon as it is known that none of its trials gives them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Set
from dataclasses import replace
from pathlib import Path

from pilotage.core.errors import InputError, nearest
from pilotage.evaluation.judge import SUCCESS
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.given import columns_of, has
from pilotage.experiments.mission import mission_of
from pilotage.experiments.studies.database import CorruptDatabaseError
from pilotage.experiments.studies.rows import flat, read_rows
from pilotage.experiments.studies.study import Study
from pilotage.experiments.studies.trial import Outcome
from pilotage.missions.mission import Mission

ENOUGH = 20
"""What none of so many trials gives none gives; fewer tell where each setting had one that succeeded."""


class Asked:
    """What one study is to report.

    Each check raises InputError with the nearest metric that its trials can give.
    """

    def __init__(self, study: Study) -> None:
        definition = study.definition
        pairs = [name for entry in definition.contrasts for name in (entry.metric, entry.against)]
        primary = [] if definition.primary is None else [definition.primary]
        self._study = study
        self._reported = tuple(dict.fromkeys([*definition.metrics, *primary, *pairs]))
        self._held_against = {
            *(name for e in definition.published for name in e.metrics),
            *definition.reference,
        }
        self._looked_at: set[str] = set()
        self._finished, self._quiet = 0, set(range(len(study.cells)))  # of these no trial has succeeded yet

    def check_tasks(self) -> None:
        """By what the missions say."""
        asked = {*self._reported, *self._held_against}
        known: set[str] = set()
        settled: set[str] = set()
        tasks: set[str] = set()
        for mission in self._missions():
            if asked <= known:
                return
            task, there = mission.task.name, has(mission)
            settled |= METRICS.given_by(task, there | {"settled"})
            tasks.add(task)
            known |= METRICS.given_by(task, there)
        _refuse(
            sorted(asked), known, f"no mission of the task {' or '.join(sorted(tasks))} gives it", settled
        )

    def check_columns(self) -> None:
        """By what the missions' components tell: as many are built as it takes."""
        self._check_told([METRICS.find(key) for key in self._reported])

    def hear(self, cell: int, outcome: Outcome, database: Path) -> None:
        """By a trial that was just written: what its trace lacks; once they tell enough, by all so far."""
        lacking = {key: column for key, column in outcome.lacking.items() if key not in self._looked_at}
        self._looked_at |= lacking.keys()
        metrics = [METRICS.find(key) for key in self._reported if key in lacking]
        self._check_told(
            [replace(metric, columns=metric.columns | {lacking[metric.key]}) for metric in metrics]
        )
        self._finished += not outcome.reason
        if outcome.metrics.get(SUCCESS) and self._quiet:
            self._quiet.discard(cell)
            if not self._quiet:
                self.check_rows(database, computed=False)
        if self._finished == ENOUGH and not outcome.reason:
            self.check_rows(database)

    def check_rows(self, database: Path, *, computed: bool = True) -> None:
        """By the trials that succeeded: one that found no path has no length, and a study may find just that.

        What need not happen in any of them is not refused.

        Parameters
        ----------
        computed
            Also metrics that are computed from traces: whether what they tell of need happen they do not say.
        """
        rows, trouble = read_rows(database)
        if trouble:
            raise CorruptDatabaseError(database, trouble)
        given: set[str] = set()
        for row in rows:
            if row["metrics"].get(SUCCESS) is False:
                continue
            given |= flat(row["metrics"]).keys() | flat(row["timings"]).keys()
        if given:
            asked = [
                metric.key
                for metric in map(METRICS.find, self._reported)
                if not metric.sometimes and (computed or metric.compute is None)
            ]
            _refuse(asked, given, f"no trial of the study '{self._study.name}' gives it")

    def _check_told(self, metrics: Iterable[Metric]) -> None:
        open_ = [metric for metric in metrics if metric.columns]
        given: set[str] = set()
        for mission in self._missions():
            if not open_:
                return
            try:
                columns = columns_of(mission)
            except InputError:  # its trials will tell, or another setting's
                return
            task, there = mission.task.name, has(mission)
            open_ = [m for m in open_ if not (m.is_given_by(task, there) and m.is_told_by(columns))]
            can = METRICS.given_by(task, there)
            given |= {metric.key for metric in METRICS if metric.key in can and metric.is_told_by(columns)}
        for metric in open_:
            told = " and ".join(f"'{name}'" for name in sorted(metric.columns))
            why = f"no trace of the study '{self._study.name}' has the column {told}, which it is made from"
            _refuse([metric.key], given - {metric.key}, why)

    def _missions(self) -> Iterator[Mission]:
        """Each setting's, as its first trial has it."""
        first = f"run.seed={self._study.definition.seeds.first}"
        for cell in self._study.cells:
            yield mission_of(self._study.base, (*cell.overrides, first))


def _refuse(asked: Iterable[str], given: Set[str], why: str, longer: Set[str] = frozenset()) -> None:
    """Refuse a metric that is not given; those in ``longer`` would be by longer runs."""
    for metric in asked:
        if metric not in given:
            if metric in longer:
                raise InputError(
                    f"metric '{metric}': expected a run.time_limit_s above run.settle_s, after which errors "
                    "count, found runs that end within it"
                )
            close = nearest(metric, sorted(given))
            hint = f"; did you mean '{close}'?" if close else ""
            raise InputError(f"metric '{metric}': {why}{hint}")
