"""Running a study: claim, hand out, write down, until nothing is missing."""

from __future__ import annotations

import contextlib
import errno
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.whole_file import write_whole
from pilotage.experiments.build.build import build_source
from pilotage.experiments.mission import mission_of
from pilotage.experiments.studies.asked import Asked
from pilotage.experiments.studies.dask_workers import DaskWorkers
from pilotage.experiments.studies.database import (
    DATABASE,
    CorruptDatabaseError,
    StudyStoppedError,
    drop_log,
    has_log,
)
from pilotage.experiments.studies.export import save_what_is_left
from pilotage.experiments.studies.local_workers import LocalWorkers
from pilotage.experiments.studies.options import StudyOptions, cores
from pilotage.experiments.studies.store import Counts, Store
from pilotage.experiments.studies.study import (
    MISSION_FILE,
    Study,
    mission_yaml,
    study_yaml,
)
from pilotage.experiments.studies.unbuilt import NothingBuiltError, Unbuilt
from pilotage.experiments.studies.workers import Workers
from pilotage.records.folder import STUDY_FILE

HEAR_EVERY_S = 5.0
TELL_EVERY_S = 0.1
QUIET_S = 10.0
"""For so long nothing is told of a study of which no trial has shown yet that it can be."""


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """How far a study is: its counts, the rate of this process, and how long it will take."""

    counts: Counts
    rate_per_s: float
    left_s: float


@dataclass(frozen=True, slots=True)
class Listener:
    """Who is told how a study goes.

    Attributes
    ----------
    progress
        Told some times a second.
    trouble
        Told, a line each, of a worker that died, a trial that broke or hung, a disk that is full.
    """

    progress: Callable[[StudyProgress], None] = lambda _: None
    trouble: Callable[[str], None] = lambda _: None


def run_study(
    study: Study, folder: Path, options: StudyOptions | None = None, listener: Listener | None = None
) -> Counts:
    """Run what is missing of a study in ``folder``.

    Raises
    ------
    InputError
        Of no cell anything can be built (nothing is left behind then);
        a metric that no mission of the study's tasks gives, or no component tells what it is made from
        (nothing is run or written then), or that no trial gives; the folder holds another definition, was
        begun and ``resume`` is not said, or was not and it is; a corrupt database, after what can be read of
        it was saved.
    StudyStoppedError
        The disk is full and stays so, the cluster is gone, or no worker can begin.
    KeyboardInterrupt
        Passed on, with all finished rows written and the claims given back.
    """
    options, listener = options or StudyOptions(), listener or Listener()
    asked = Asked(study)
    asked.check_tasks()
    if options.resume and not folder.is_dir():
        raise InputError(f"{folder}: expected a study that was begun, found none; leave --resume out")
    if not (folder / DATABASE).is_file():
        check_worlds(study)
        asked.check_columns()
    had_log = has_log(folder / DATABASE)
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        try:
            counts = _run(study, folder, options, listener, asked)
        except NothingBuiltError:  # nothing is left of what cannot be
            if made:
                shutil.rmtree(folder, ignore_errors=True)
            for parent in made[1:]:
                with contextlib.suppress(OSError):  # somebody else has put something there
                    parent.rmdir()
            raise
        asked.check_rows(folder / DATABASE)
    except CorruptDatabaseError as error:
        saved = save_what_is_left(folder, study, error.trouble)
        if not had_log:
            drop_log(folder / DATABASE)
        raise saved from None
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        raise StudyStoppedError(f"{folder}: the disk is full; make room and go on with --resume") from None
    drop_log(folder / DATABASE)
    return counts


def check_worlds(study: Study) -> None:
    """Build a world and its robots with every value that a factor or configuration has, each at least once.

    Raises
    ------
    InputError
        With the cell's name: every one of its trials would fail.
    """
    seen: set[str] = set()
    for cell in study.cells:
        values = {f"{name}={value!r}" for name, value in cell.values.items()}
        if values and values <= seen:
            continue
        seen |= values
        try:
            build_source(
                mission_of(study.base, (*cell.overrides, f"run.seed={study.definition.seeds.first}"))
            )
        except InputError as error:
            raise InputError(f"cell '{cell.name}': {error}") from None


def _run(study: Study, folder: Path, options: StudyOptions, listener: Listener, asked: Asked) -> Counts:
    with contextlib.ExitStack() as stack:
        # Before a folder is made: nothing is left behind where nobody answers.
        crew: Workers | None = None
        if options.dask is not None:
            crew = DaskWorkers(study.base, options.dask, options.trial_timeout_s)
            stack.callback(_put_away, crew.stop)
        begun = (folder / DATABASE).is_file()
        store = Store(folder, study, listener.trouble)
        # Where this fails, as on a full disk, the claims are free again once this process is gone.
        stack.callback(_put_away, store.close)
        if options.retry_failed:
            store.retry_failed()
        counts = store.counts()
        if begun and not options.resume and 0 < counts.missing < counts.total:
            ended = f"{counts.done + counts.failed} of {counts.total} trials are finished"
            if store.others():
                raise InputError(f"{folder}: {ended}, another process is at work; join it with --resume")
            raise InputError(f"{folder}: {ended}; go on with --resume")
        _write(folder / STUDY_FILE, study_yaml(study))
        _write(folder / MISSION_FILE, mission_yaml(study))
        if counts.missing:
            if crew is None:
                count = min(options.workers or cores(), counts.missing)
                memory = options.worker_memory_bytes(count)
                crew = LocalWorkers(study.base, count, options.trial_timeout_s, memory)
                stack.callback(_put_away, crew.stop)
            fresh = not begun and not store.others()
            _loop(study, store, crew, asked, listener, fresh=fresh)
        return store.counts()


def _loop(
    study: Study, store: Store, crew: Workers, asked: Asked, listener: Listener, *, fresh: bool
) -> None:
    began = heard = time.monotonic()
    shown, finished = 0.0, 0
    held: dict[int, int] = {}  # rows under way, and their cells
    unbuilt = Unbuilt(study, listener.trouble, fresh=fresh)
    while True:
        room = crew.room
        for task in store.claim(room) if room else ():
            held[task.row] = task.cell
            crew.give(replace(task, overrides=study.cells[task.cell].overrides))
        if not held:
            if not store.counts().missing:
                unbuilt.let_go()
                return
            time.sleep(0.2)  # the rest is run by another process
            store.hear()
            continue
        for outcome in crew.outcomes():
            cell = held.pop(outcome.row)
            again = store.finish(outcome)
            finished += not outcome.reason
            then = "tried once more" if again else "given up"
            told = f"row {outcome.row}: {outcome.reason}; {then}" if outcome.reason else ""
            unbuilt.hear(cell, outcome, told)
            asked.hear(cell, outcome, store.path)
        now = time.monotonic()
        if now - heard > HEAR_EVERY_S:
            store.hear()
            heard = now
        if now - shown > TELL_EVERY_S and not (unbuilt.asks and now - began < QUIET_S):
            counts = store.counts()
            rate = finished / max(now - began, 1e-9)
            left = counts.missing / rate if rate > 0.0 else float("inf")
            listener.progress(StudyProgress(counts, rate, left))
            shown = now


def _put_away(close: Callable[[], None]) -> None:
    """Close one of a study's helpers; a disk that is full then has been told already."""
    with _undisturbed(), contextlib.suppress(StudyStoppedError, CorruptDatabaseError):
        close()


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


def _write(path: Path, text: str) -> None:
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return
    write_whole(path, text)
