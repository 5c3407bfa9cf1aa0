"""Worker processes on this machine: spawned once, fed one task ahead, replaced where they die."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, Protocol

from pilotage.experiments.studies.trial import Outcome, Task, TrialRunner
from pilotage.kernels.jit import cache_is_cold

AHEAD = 2
"""Tasks that a worker holds: the one it runs and the next."""
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
WAIT_S = 1.0


class Workers(Protocol):
    """Whoever runs tasks."""

    @property
    def room(self) -> int:
        """How many more tasks it takes now."""
        ...

    def give(self, task: Task) -> None:
        """Hand one task over."""
        ...

    def outcomes(self) -> Iterator[Outcome]:
        """What has ended since the last call; waits a moment where nothing has."""
        ...

    def stop(self) -> None:
        """Stop at once; what runs is lost."""
        ...


@dataclass(slots=True)
class _Worker:
    process: SpawnProcess
    pipe: Connection
    tasks: list[Task] = field(default_factory=list)


class LocalWorkers:
    """Spawned processes, each with a pipe of its own."""

    def __init__(self, base: Mapping[str, Any], count: int) -> None:
        self._base = dict(base)
        self._context = multiprocessing.get_context("spawn")
        # Where nothing is compiled yet, one of them does it for all.
        self._count = count
        self._workers = [self._start() for _ in range(1 if cache_is_cold() else count)]

    @property
    def room(self) -> int:
        """Places that are free."""
        return sum(AHEAD - len(worker.tasks) for worker in self._workers)

    def give(self, task: Task) -> None:
        """To the worker that has least to do."""
        worker = min(self._workers, key=lambda w: len(w.tasks))
        worker.tasks.append(task)
        # One that has just died is seen to at the next look at the outcomes.
        with contextlib.suppress(OSError):
            worker.pipe.send(task)

    def outcomes(self) -> Iterator[Outcome]:
        """What came through the pipes; a worker that died is replaced and its task told."""
        ready = wait([w.pipe for w in self._workers] + [w.process.sentinel for w in self._workers], WAIT_S)
        for number, worker in enumerate(self._workers):
            if worker.pipe in ready:
                try:
                    while worker.pipe.poll():
                        outcome: Outcome = worker.pipe.recv()
                        worker.tasks = [task for task in worker.tasks if task.row != outcome.row]
                        yield outcome
                        self._fill_up()
                except (EOFError, OSError):
                    pass
            if worker.process.sentinel in ready and not worker.process.is_alive():
                yield from self._replace(number)

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
        process = self._context.Process(target=_work, args=(there, self._base), daemon=True)
        kept = {name: os.environ.get(name) for name in ONE_THREAD}
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        try:
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
        fresh = self._workers[number] = self._start()
        for task in dead.tasks[1:]:
            fresh.tasks.append(task)
            fresh.pipe.send(task)
        if dead.tasks:
            how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
            yield Outcome(dead.tasks[0].row, {}, {}, f"its worker died ({how})", retry=True)


def _work(pipe: Connection, base: Mapping[str, Any]) -> None:
    """A worker's life: run what comes, until the pipe closes."""
    # Ctrl-C goes to the whole group: the parent decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    runner = TrialRunner(base)
    try:
        while True:
            pipe.send(runner.run(pipe.recv()))
    except (EOFError, OSError):
        return
