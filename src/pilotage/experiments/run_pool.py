"""Many runs on this machine's processes, each on its own; what comes out does not depend on their number."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from pilotage.core.errors import InputError
from pilotage.core.memory import look_seldom
from pilotage.core.plugins import fault_of, refusal_of
from pilotage.experiments import worker_processes
from pilotage.experiments.worker_processes import interrupts_held, obey_the_parent

J = TypeVar("J", bound=tuple[Any, ...])
R = TypeVar("R")


def all_done(work: Callable[..., R], jobs: Sequence[J], workers: int, what: str) -> Iterator[tuple[J, R]]:
    """Every job with ``work(*job)``, as they come in.

    Raises
    ------
    InputError
        Where a worker dies; whatever a job raises.
    """
    if workers == 1 or len(jobs) < 2:
        for job in jobs:
            yield job, work(*job)
        return
    pool = ProcessPoolExecutor(min(workers, len(jobs)), worker_processes.context(), _begin)
    others = set(multiprocessing.active_children())
    done = False
    try:
        with interrupts_held():
            waiting = {pool.submit(blamed, work, *job): job for job in jobs}
        for future in as_completed(waiting):
            yield waiting[future], future.result()
        done = True
    except BrokenProcessPool:
        raise InputError(f"{what}: a worker died; take fewer --workers, or more memory") from None
    finally:
        if not done:
            # Whoever stops here does not wait for runs that take minutes; a worker leaves nothing behind.
            for worker in set(multiprocessing.active_children()) - others:
                worker.terminate()
        pool.shutdown(cancel_futures=True)


def blamed(work: Callable[..., R], *job: Any) -> R:
    """One job in a worker.

    Raises
    ------
    InputError
        For what a plugin raises: where it did so is lost on the way to the parent, and what ends a process
        would end the pool. Whatever else the job raises.
    """
    try:
        return work(*job)
    except BaseException as error:
        fault = fault_of(error)
        if fault is None:
            raise
        raise InputError(refusal_of(error) if isinstance(error, InputError) else fault.line) from None


def _begin() -> None:
    obey_the_parent()
    look_seldom()
