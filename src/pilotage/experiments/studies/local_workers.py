"""Worker processes on this machine: spawned once, fed one task ahead, replaced where they die."""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import time
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from pilotage.core.memory import look_seldom
from pilotage.experiments import worker_processes
from pilotage.experiments.studies.database import StudyStoppedError
from pilotage.experiments.studies.trial import Outcome, Task, TrialRunner
from pilotage.experiments.studies.workers import AHEAD, WAIT_S, hung
from pilotage.experiments.worker_processes import interrupts_held, obey_the_parent
from pilotage.kernels.code_cache import cache_is_cold

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
STILLBORN = 4
"""So many workers in a row that die before they can begin: the fault is not a trial's."""


@dataclass(slots=True)
class _Worker:
    process: SpawnProcess
    pipe: Connection
    tasks: list[Task] = field(default_factory=list)
    ready: bool = False
    since_s: float = 0.0
    hung: bool = False


class LocalWorkers:
    """Spawned processes, each with a pipe of its own.

    Parameters
    ----------
    base
        The mission's values before any cell's overrides.
    timeout_s
        Wall time after which the worker of a trial is killed.
    memory_bytes
        What a worker may allocate; where more is asked for its trial fails.

    Raises
    ------
    StudyStoppedError
        From ``outcomes``, where one worker after another dies before it can begin.
    """

    def __init__(self, base: Mapping[str, Any], count: int, timeout_s: float, memory_bytes: int) -> None:
        self._base = dict(base)
        self._timeout_s, self._memory_bytes = timeout_s, memory_bytes
        self._context = worker_processes.context()
        # Where nothing is compiled yet, one of them does it for all.
        self._count = count
        self._stillborn = 0
        self._workers = [self._start() for _ in range(1 if cache_is_cold() else count)]

    @property
    def room(self) -> int:
        """Places that are free."""
        return sum(AHEAD - len(worker.tasks) for worker in self._workers)

    def give(self, task: Task) -> None:
        """To the worker that has least to do."""
        worker = min(self._workers, key=lambda w: len(w.tasks))
        if not worker.tasks:
            worker.since_s = _now_s()
        worker.tasks.append(task)
        # One that has just died is seen to at the next look at the outcomes.
        with contextlib.suppress(OSError):
            worker.pipe.send(task)

    def outcomes(self) -> Iterator[Outcome]:
        """What came through the pipes; a worker that died or hung is replaced and its task told."""
        ready = wait([w.pipe for w in self._workers] + [w.process.sentinel for w in self._workers], WAIT_S)
        for number, worker in enumerate(list(self._workers)):
            # Read first, also what a worker left behind that has died since.
            if worker.pipe in ready or worker.process.sentinel in ready:
                for outcome in self._received(worker):
                    yield outcome
                    self._fill_up()
            if worker.tasks and worker.ready and _now_s() - worker.since_s > self._timeout_s:
                worker.hung = True
                worker.process.kill()
                worker.process.join()
            if not worker.process.is_alive() and (worker.hung or worker.process.sentinel in ready):
                yield from self._replace(number)

    def _received(self, worker: _Worker) -> Iterator[Outcome]:
        try:
            while worker.pipe.poll():
                message: Outcome | None = worker.pipe.recv()
                worker.since_s = _now_s()
                if message is None:
                    worker.ready, self._stillborn = True, 0
                    continue
                worker.tasks = [task for task in worker.tasks if task.row != message.row]
                yield message
        except (EOFError, OSError, pickle.UnpicklingError):  # it died in the middle of a word
            pass

    def _fill_up(self) -> None:
        while len(self._workers) < self._count:
            self._workers.append(self._start())

    def stop(self) -> None:
        """Kill all workers."""
        for worker in self._workers:
            worker.process.kill()
        for worker in self._workers:
            worker.process.join()
            worker.pipe.close()
        self._workers = []

    def _start(self) -> _Worker:
        here, there = self._context.Pipe()
        process = self._context.Process(
            target=_work, args=(there, self._base, self._memory_bytes), daemon=True
        )
        kept = {name: os.environ.get(name) for name in ONE_THREAD}
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        try:
            with interrupts_held(), _main_left_alone():
                process.start()
        finally:
            for name, value in kept.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
        there.close()
        return _Worker(process, here)

    def _replace(self, number: int) -> Iterator[Outcome]:
        """A new worker in the place of a dead one, which broke on the first task that it held."""
        dead = self._workers[number]
        dead.process.join()
        code = dead.process.exitcode
        dead.pipe.close()
        how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
        if not dead.ready:
            # No trial is to blame: it had not begun one.
            self._stillborn += 1
            if self._stillborn >= STILLBORN:
                raise StudyStoppedError(
                    f"{self._stillborn} workers died one after another before they could begin ({how}); "
                    "mend that and go on with --resume"
                )
        fresh = self._workers[number] = self._start()
        for task in dead.tasks[1:] if dead.ready else dead.tasks:
            fresh.tasks.append(task)
            with contextlib.suppress(OSError):
                fresh.pipe.send(task)
        fresh.since_s = _now_s()
        if dead.tasks and dead.ready:
            row = dead.tasks[0].row
            died = Outcome(row, {}, {}, f"its worker died ({how})", retry=True)
            yield hung(row, self._timeout_s) if dead.hung else died


def _now_s() -> float:
    return time.monotonic()


@contextlib.contextmanager
def _main_left_alone() -> Iterator[None]:
    """Spawned workers do not run the user's script again: a study is started in a plain script as well.

    What they work on is imported by name; components of the user's own come from plugin files.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _work(pipe: Connection, base: Mapping[str, Any], memory_bytes: int) -> None:
    """A worker's life: run what comes, until the pipe closes."""
    _bound_memory(memory_bytes)
    look_seldom()
    obey_the_parent()
    runner = TrialRunner(base)
    try:
        pipe.send(None)  # ready
        while True:
            pipe.send(runner.run(pipe.recv()))
    except (EOFError, OSError):
        return


def _bound_memory(most_bytes: int) -> None:
    """Let what asks for more memory fail with a MemoryError, where the system knows how (Linux)."""
    if sys.platform == "linux":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        most = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
