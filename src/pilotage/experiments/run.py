"""One run of one mission, whatever its kind: step it to its end, evaluate, write the run folder."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.kinds import check_oracles, kind_of
from pilotage.experiments.mission_kind import Record
from pilotage.experiments.progress import OnProgress
from pilotage.experiments.run_folder import write_run_folder
from pilotage.experiments.task_of import task_of
from pilotage.missions.mission import Mission


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came out: the metrics, whether the task succeeded, and where the evidence is."""

    metrics: dict[str, object]
    success: bool
    run_dir: Path | None


def run_mission(
    mission: Mission,
    *,
    out: Path | None = None,
    save: bool = True,
    on_progress: OnProgress | None = None,
) -> RunResult:
    """Run a mission.

    Parameters
    ----------
    out
        Folder that the run folder is made in; None takes ``runs`` in the working folder.
    save
        Whether to write a run folder at all.
    on_progress
        Called about ten times a second.

    Raises
    ------
    InputError
        Where the mission cannot be built; nothing has been written then.
    """
    kind = kind_of(mission)
    check_oracles(kind, mission)
    kind.warm_up(mission)
    begin = time.perf_counter()
    record = kind.simulate(mission, on_progress)
    metrics = kind.metrics(record)
    metrics |= METRICS.computed(task_of(mission), record.trace, metrics)
    metrics["wall_time_s"] = time.perf_counter() - begin
    run_dir = None
    if save:
        run_dir = write_run_folder(Path("runs") if out is None else out, kind, record, metrics)
        metrics["run_dir"] = str(run_dir)
    return RunResult(metrics, bool(metrics["success"]), run_dir)


def simulate(mission: Mission, on_progress: OnProgress | None = None) -> Record:
    """Build a mission and step it to its end, without judging it."""
    kind = kind_of(mission)
    check_oracles(kind, mission)
    return kind.simulate(mission, on_progress)
