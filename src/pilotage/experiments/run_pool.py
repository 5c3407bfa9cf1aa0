"""Many runs on this machine's processes, each on its own; what comes out does not depend on their number."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from pilotage.core.errors import InputError
from pilotage.core.memory import look_seldom

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
    pool = ProcessPoolExecutor(min(workers, len(jobs)), multiprocessing.get_context("spawn"), _begin)
    try:
        waiting = {pool.submit(work, *job): job for job in jobs}
        for future in as_completed(waiting):
            yield waiting[future], future.result()
    except BrokenProcessPool:
        raise InputError(f"{what}: a worker died; take fewer --workers, or more memory") from None
    finally:
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    look_seldom()
