"""One trial: a cell's mission with a seed, run and measured; the same wherever it runs."""

from __future__ import annotations

import errno
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.plugins import fault_of, refusal_of
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from pilotage.missions.mission import Mission
from pilotage.records.metrics import clean

REASON_LENGTH = 500
PLACES = frozenset({"run_dir"})


@dataclass(frozen=True, slots=True)
class Task:
    """One row to run."""

    row: int
    cell: int
    seed: int
    overrides: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a task.

    Attributes
    ----------
    reason
        Why there are no metrics; empty where there are.
    retry
        Whether another try may do better: anything but a mission that cannot be built.
    seconds
        Wall time of the trial itself.
    lacking
        Metrics that ask for a column that its trace has not, with that column.
    """

    row: int
    metrics: Mapping[str, Any]
    timings: Mapping[str, float | None]
    reason: str = ""
    retry: bool = False
    seconds: float = math.nan
    lacking: Mapping[str, str] = field(default_factory=dict)


class TrialRunner:
    """Runs tasks of one study in one process.

    Parameters
    ----------
    base
        The mission's values before any cell's overrides.
    """

    _KEPT = 64

    def __init__(self, base: Mapping[str, Any]) -> None:
        self._base = dict(base)
        self._missions: dict[tuple[str, ...], Mission] = {}

    def run(self, task: Task) -> Outcome:
        """Run one task; whatever goes wrong in it is its outcome."""
        try:
            return measured(task.row, self.mission(task.overrides, task.seed))
        except InputError as error:
            return Outcome(task.row, {}, {}, refusal_of(error))
        except BaseException as error:  # what goes wrong in one trial is that trial's, not the study's
            if not isinstance(error, Exception) and fault_of(error) is None:
                raise
            return Outcome(task.row, {}, {}, _said(error), retry=True)

    def mission(self, overrides: Sequence[str], seed: int) -> Mission:
        """The mission of a cell with a seed; validated once a cell."""
        key = tuple(overrides)
        mission = self._missions.get(key)
        if mission is None:
            if len(self._missions) >= self._KEPT:
                self._missions.pop(next(iter(self._missions)))
            mission = self._missions[key] = mission_of(self._base, key)
        return mission.model_copy(update={"run": mission.run.model_copy(update={"seed": seed})})


def measured(row: int, mission: Mission) -> Outcome:
    """Run a mission without saving it, its metrics parted into those that repeat and those that do not."""
    result = run_mission(mission, save=False)
    metrics = clean(dict(result.metrics))
    timings = {key: value for key, value in metrics.items() if METRICS.is_wall_clock(key)}
    kept = {key: value for key, value in metrics.items() if key not in timings and key not in PLACES}
    return Outcome(row, kept, timings, seconds=metrics["wall_time_s"], lacking=result.lacking)


def _said(error: BaseException) -> str:
    """The error in one line; a plugin's own by its file and line."""
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        return f"disk full: {error.filename or error.strerror}"
    fault = fault_of(error)
    if fault is not None:
        return " ".join(fault.line.split())[:REASON_LENGTH]
    words = " ".join(str(error).split())[:REASON_LENGTH]
    if isinstance(error, MemoryError):
        words = f"{words or 'out of memory'}; a worker's is bounded by --worker-memory"
    return f"{type(error).__name__}: {words}" if words else type(error).__name__
