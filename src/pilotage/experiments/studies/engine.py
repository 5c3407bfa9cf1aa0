"""Running a study: claim, hand out, write down, until nothing is missing."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pilotage.core.errors import InputError, nearest
from pilotage.core.whole_file import write_whole
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.given import has
from pilotage.experiments.mission import mission_of
from pilotage.experiments.studies.dask_workers import DaskWorkers
from pilotage.experiments.studies.database import DATABASE, CorruptDatabaseError, StudyStoppedError
from pilotage.experiments.studies.export import save_what_is_left
from pilotage.experiments.studies.local_workers import LocalWorkers
from pilotage.experiments.studies.rows import flat, read_rows
from pilotage.experiments.studies.store import Counts, Store
from pilotage.experiments.studies.study import (
    MISSION_FILE,
    STUDY_FILE,
    Study,
    mission_yaml,
    study_yaml,
)
from pilotage.experiments.studies.workers import Workers

HEAR_EVERY_S = 5.0
TELL_EVERY_S = 0.1
LONG_S = 120.0
LONG_TIMES = 20.0
"""A trial that takes both more than LONG_S and so many times the longest one so far may hang."""
ENOUGH_TO_TELL = 20
"""A metric that none of so many trials gives is given by none."""


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """How far a study is: its counts, the rate of this process, and how long it will take."""

    counts: Counts
    rate_per_s: float
    left_s: float


def run_study(
    study: Study,
    folder: Path,
    *,
    workers: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    on_progress: Callable[[StudyProgress], None] | None = None,
    on_trouble: Callable[[str], None] | None = None,
) -> Counts:
    """Run what is missing of a study in ``folder``.

    Parameters
    ----------
    workers
        Processes on this machine; None takes one a core.
    dask
        A scheduler's address instead.
    resume
        Whether to go on with a folder that was begun before; a complete one is left as it is.
    on_trouble
        Told, a line each, of a worker that died, a trial that broke or takes very long, a disk that is full.

    Raises
    ------
    InputError
        A metric that no mission of the kind gives (nothing is run or written then), or that no trial gives;
        the folder holds another definition, or was begun and ``resume`` is not said; a corrupt database,
        after what can be read of it was saved.
    StudyStoppedError
        The disk is full and stays so, the cluster is gone, or no worker can begin.
    KeyboardInterrupt
        Passed on, with all finished rows written and the claims given back.
    """
    tell = on_trouble or (lambda _: None)
    check_metric_names(study)
    try:
        counts = _run(study, folder, workers, dask, resume, on_progress, tell)
        check_metrics(study, folder)
    except CorruptDatabaseError as error:
        raise save_what_is_left(folder, study, error.trouble) from None
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        raise StudyStoppedError(f"{folder}: the disk is full; make room and go on with --resume") from None
    return counts


def _run(
    study: Study,
    folder: Path,
    workers: int | None,
    dask: str | None,
    resume: bool,
    on_progress: Callable[[StudyProgress], None] | None,
    tell: Callable[[str], None],
) -> Counts:
    # Before a folder is made: nothing is left behind where nobody answers.
    cluster = DaskWorkers(study.base, dask) if dask else None
    try:
        return _run_on(cluster, study, folder, workers, resume, on_progress, tell)
    finally:
        if cluster is not None:
            with _undisturbed():
                cluster.stop()


def _run_on(
    cluster: Workers | None,
    study: Study,
    folder: Path,
    workers: int | None,
    resume: bool,
    on_progress: Callable[[StudyProgress], None] | None,
    tell: Callable[[str], None],
) -> Counts:
    """Run what is missing on a cluster, or on processes here."""
    begun = (folder / DATABASE).is_file()
    store = Store(folder, study, tell)
    try:
        counts = store.counts()
        if begun and not resume and counts.missing and counts.missing < counts.total:
            ended = f"{counts.done + counts.failed} of {counts.total} trials are finished"
            if store.others():
                raise InputError(f"{folder}: {ended}, another process is at work; join it with --resume")
            raise InputError(f"{folder}: {ended}; go on with --resume")
        _write(folder / STUDY_FILE, study_yaml(study))
        _write(folder / MISSION_FILE, mission_yaml(study))
        if counts.missing:
            wanted = min(workers or _cores(), counts.missing)
            crew: Workers = cluster or LocalWorkers(study.base, wanted)
            try:
                _loop(study, store, crew, folder, on_progress, tell)
            finally:
                if cluster is None:
                    with _undisturbed():
                        crew.stop()
        return store.counts()
    finally:
        # Where this fails, as on a full disk, the claims are free again once this process is gone.
        with _undisturbed(), contextlib.suppress(StudyStoppedError, CorruptDatabaseError):
            store.close()


def _loop(
    study: Study,
    store: Store,
    crew: Workers,
    folder: Path,
    on_progress: Callable[[StudyProgress], None] | None,
    tell: Callable[[str], None],
) -> None:
    began = heard = time.monotonic()
    shown, finished, longest_s = 0.0, 0, 0.0
    held: set[int] = set()
    told: set[tuple[int, int]] = set()
    checked = False
    while True:
        room = crew.room
        for task in store.claim(room) if room else ():
            held.add(task.row)
            crew.give(replace(task, overrides=study.cells[task.cell].overrides))
        if not held:
            counts = store.counts()
            if not counts.missing:
                return
            time.sleep(0.2)  # the rest is run by another process
            store.hear()
            continue
        for outcome in crew.outcomes():
            held.discard(outcome.row)
            again = store.finish(outcome)
            if outcome.reason:
                tell(f"row {outcome.row}: {outcome.reason}; {'tried once more' if again else 'given up'}")
            else:
                finished += 1
                longest_s = max(longest_s, outcome.seconds)
        now = time.monotonic()
        if now - heard > HEAR_EVERY_S:
            store.hear()
            heard = now
            for trial in crew.running():
                if trial.seconds > max(LONG_S, LONG_TIMES * longest_s) and (trial.row, trial.pid) not in told:
                    told.add((trial.row, trial.pid))
                    tell(
                        f"row {trial.row} has run for {trial.seconds:.0f} s; where it hangs, "
                        f"'kill -9 {trial.pid}' gives it up"
                    )
        if not checked and finished >= ENOUGH_TO_TELL:
            check_metrics(study, folder)
            checked = True
        if on_progress is not None and now - shown > TELL_EVERY_S:
            counts = store.counts()
            rate = finished / max(now - began, 1e-9)
            left = counts.missing / rate if rate > 0.0 else float("inf")
            on_progress(StudyProgress(counts, rate, left))
            shown = now


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Let a second Ctrl-C wait until what the first one stopped is put away."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_metric_names(study: Study) -> None:
    """Refuse a metric that no trial of the study can give.

    Raises
    ------
    InputError
        With the nearest one that they can give.
    """
    definition = study.definition
    told = [*(name for entry in definition.published for name in entry.metrics), *definition.reference]
    asked = {*_asked(study), *told}
    known: set[str] = set()
    tasks: set[str] = set()
    for cell in study.cells:
        if asked <= known:
            return
        mission = mission_of(dict(study.base), cell.overrides)
        tasks.add(mission.task.name)
        known |= METRICS.given_by(mission.task.name, has(mission))
    for metric in sorted(asked - known):
        close = nearest(metric, sorted(known))
        hint = f"; did you mean '{close}'?" if close else ""
        named = " or ".join(f"'{task}'" for task in sorted(tasks))
        raise InputError(f"metric '{metric}': no trial of this study gives it (its task: {named}){hint}")


def _asked(study: Study) -> list[str]:
    """The metrics that a study is to report."""
    definition = study.definition
    primary = [] if definition.primary is None else [definition.primary]
    return [*definition.metrics, *primary, *(m for e in definition.contrasts for m in (e.metric, e.against))]


def check_metrics(study: Study, folder: Path) -> None:
    """Refuse a metric that none of the finished trials gives.

    Raises
    ------
    InputError
        With the nearest one that they do give.
    """
    rows, trouble = read_rows(folder / DATABASE)
    if trouble:
        raise CorruptDatabaseError(folder / DATABASE, trouble)
    given: set[str] = set()
    for row in rows:
        given |= flat(row["metrics"]).keys() | flat(row["timings"]).keys()
    if not given:
        return
    for metric in _asked(study):
        if metric not in given:
            close = nearest(metric, given)
            hint = f"; did you mean '{close}'?" if close else ""
            raise InputError(f"metric '{metric}': no trial of the study '{study.name}' gives it{hint}")


def _write(path: Path, text: str) -> None:
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return
    write_whole(path, text)
