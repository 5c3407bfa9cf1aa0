"""Running a study: claim, hand out, write down, until nothing is missing."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pilotage.core.errors import InputError, PilotageError, nearest
from pilotage.experiments.studies.dask_workers import DaskWorkers
from pilotage.experiments.studies.local_workers import LocalWorkers, Workers
from pilotage.experiments.studies.store import DATABASE, Counts, Store, flat, read_rows
from pilotage.experiments.studies.study import (
    MISSION_FILE,
    STUDY_FILE,
    Study,
    mission_yaml,
    study_yaml,
)

HEAR_EVERY_S = 5.0
ENOUGH_TO_TELL = 20
"""A metric that none of so many trials gives is given by none."""


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """How far a study is: its counts, the rate of this process, and how long it will take."""

    counts: Counts
    rate_per_s: float
    left_s: float


class StudyStoppedError(PilotageError):
    """The study cannot go on now; what is finished is kept, and the message says how to go on."""


def run_study(
    study: Study,
    folder: Path,
    *,
    workers: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    on_progress: Callable[[StudyProgress], None] | None = None,
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

    Raises
    ------
    InputError
        The folder holds another definition, or was begun and ``resume`` is not said; a metric that no
        trial gives.
    StudyStoppedError
        The disk is full.
    KeyboardInterrupt
        Passed on, with all finished rows written and the claims given back.
    """
    begun = (folder / DATABASE).is_file()
    store = Store(folder, study)
    try:
        counts = store.counts()
        if begun and not resume and counts.missing and counts.missing < counts.total:
            raise InputError(
                f"{folder}: {counts.done + counts.failed} of {counts.total} trials are finished; "
                "go on with --resume"
            )
        _write(folder / STUDY_FILE, study_yaml(study))
        _write(folder / MISSION_FILE, mission_yaml(study))
        if counts.missing:
            wanted = min(workers or os.cpu_count() or 1, counts.missing)
            crew: Workers = DaskWorkers(study.base, dask) if dask else LocalWorkers(study.base, wanted)
            try:
                _loop(study, store, crew, folder, on_progress)
            finally:
                crew.stop()
        counts = store.counts()
    except sqlite3.OperationalError as error:
        raise StudyStoppedError(
            f"{folder}: the database cannot be written ({error}); go on with --resume"
        ) from None
    finally:
        # On a full disk the claims are free again once this process is gone.
        with contextlib.suppress(sqlite3.OperationalError):
            store.close()
    check_metrics(study, folder)
    return counts


def _loop(
    study: Study,
    store: Store,
    crew: Workers,
    folder: Path,
    on_progress: Callable[[StudyProgress], None] | None,
) -> None:
    began, finished, heard = time.monotonic(), 0, time.monotonic()
    held: set[int] = set()
    checked = False
    while True:
        for task in store.claim(crew.room) if crew.room else ():
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
            store.finish(outcome)
            finished += not outcome.reason
        if time.monotonic() - heard > HEAR_EVERY_S:
            store.hear()
            heard = time.monotonic()
        if not checked and finished >= ENOUGH_TO_TELL:
            check_metrics(study, folder)
            checked = True
        if on_progress is not None:
            counts = store.counts()
            rate = finished / max(time.monotonic() - began, 1e-9)
            left = counts.missing / rate if rate > 0.0 else float("inf")
            on_progress(StudyProgress(counts, rate, left))


def check_metrics(study: Study, folder: Path) -> None:
    """Refuse a metric that none of the finished trials gives.

    Raises
    ------
    InputError
        With the nearest one that they do give.
    """
    asked = [*study.definition.metrics, *([study.definition.primary] if study.definition.primary else [])]
    rows, _ = read_rows(folder / DATABASE)
    given: set[str] = set()
    for row in rows:
        given |= flat(row["metrics"]).keys() | flat(row["timings"]).keys()
    if not given:
        return
    for metric in asked:
        if metric not in given:
            close = nearest(metric, given)
            hint = f"; did you mean '{close}'?" if close else ""
            raise InputError(f"metric '{metric}': no trial of the study '{study.name}' gives it{hint}")


def _write(path: Path, text: str) -> None:
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
