"""What every process that works for another one keeps to: its parent decides when it ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import wait
from multiprocessing.context import SpawnContext

from pilotage.core.interruptions import ENDING

TO_GROUP = frozenset(ENDING) - {signal.SIGTERM}
"""What a terminal sends to a process with all its workers."""


def context() -> SpawnContext:
    """How they are started: spawned, as a fork would take the parent's threads and numba's locks along."""
    return multiprocessing.get_context("spawn")


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Keep Ctrl-C and SIGHUP waiting while a worker starts, which inherits that and so never sees one."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover - Windows
        yield
        return
    resource_tracker.ensure_running()  # a process of its own, which undoes the hold when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, TO_GROUP)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def obey_the_parent() -> None:
    """Leave what goes to the whole group to the parent, and end when that is gone.

    Standard output is the parent's as well, maybe for one JSON object alone: what is printed goes to standard
    error.
    """
    sys.stdout = sys.stderr
    for number in TO_GROUP:
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, TO_GROUP)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End at once when the parent is gone, however it went: nobody wants what this one still computes."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
