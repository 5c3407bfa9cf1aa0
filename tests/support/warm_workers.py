"""Worker processes of studies and pools that tests start in their own process: forked, not spawned.

A spawned worker imports for two seconds of processor time what the last one imported. Here one server does it
once and each worker is forked from it; all else is as in a spawned one: the environment of who starts it,
its working folder, signals, limits and how it ends. Commands that tests start in processes of their own spawn
their workers, as they do for users (``test_studies_signals``, ``test_run_pool``, ``test_installed_plugins``,
``test_ten_minutes``, ``test_face_as_written``).
"""

from __future__ import annotations

import os
from functools import cache
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path

TESTS = Path(__file__).parents[1]


class WarmProcess(ForkServerProcess):
    """A process that begins with the environment of its parent, not with the server's."""

    def start(self) -> None:
        """Fork it from the server."""
        self.environment = dict(os.environ)
        super().start()

    def run(self) -> None:
        """Do what it is there for."""
        os.environ.clear()
        os.environ.update(self.environment)
        super().run()


class WarmContext(ForkServerContext):
    """In the place of the context in which workers are spawned."""

    Process = WarmProcess


@cache
def warm_context() -> WarmContext:
    """A context whose server runs from now on, with ``worker_imports`` imported."""
    context = WarmContext()
    context.set_forkserver_preload(["support.worker_imports"])
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(TESTS), before]))
    try:
        forkserver.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before
    return context
