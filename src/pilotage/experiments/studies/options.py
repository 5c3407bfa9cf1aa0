"""How a study is run: where, how long a trial may take, and what becomes of what was begun before."""

from __future__ import annotations

import os
from dataclasses import dataclass

from pilotage.core.errors import InputError

TRIAL_TIMEOUT_S = 3600.0
"""Wall time of a trial after which it is taken for hung, unless told otherwise."""
MEMORY_SHARE = 0.8
"""All workers together may fill this share of the machine's memory, unless told otherwise."""
LEAST_MB = 1024
"""What a worker may fill at least, unless told otherwise: the program itself takes a third of it."""
MB = 1_000_000


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """How a study is run.

    Attributes
    ----------
    workers
        Processes on this machine; None takes one a core.
    dask
        A Dask scheduler's address to run on instead; empty: none.
    resume
        Whether to go on with a folder that was begun before; a complete one is left as it is.
    retry_failed
        With ``resume``: whether trials that failed are run once more.
    trial_timeout_s
        Wall time after which a trial is stopped: it is a failed row then.
    worker_memory_mb
        What a worker on this machine may allocate (Linux); None: its share of ``MEMORY_SHARE``.

    Raises
    ------
    InputError
        Where they contradict one another, or an address is empty.
    """

    workers: int | None = None
    dask: str | None = None
    resume: bool = False
    retry_failed: bool = False
    trial_timeout_s: float = TRIAL_TIMEOUT_S
    worker_memory_mb: int | None = None

    def __post_init__(self) -> None:
        if self.dask is not None and not self.dask.strip():
            raise InputError("--dask: expected a scheduler's address such as tcp://host:8786, found none")
        if self.retry_failed and not self.resume:
            raise InputError("--retry-failed: expected --resume beside it, found none")
        if not self.trial_timeout_s > 0.0:
            raise InputError(f"--trial-timeout: expected seconds above 0, found {self.trial_timeout_s:g}")

    def worker_memory_bytes(self, workers: int) -> int:
        """What each of so many workers on this machine may allocate."""
        if self.worker_memory_mb is not None:
            return self.worker_memory_mb * MB
        machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        return max(int(MEMORY_SHARE * machine / workers), LEAST_MB * MB)


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
