"""A study's worker whose trials misbehave as they are told: killed, out of memory, out of disk, hanging."""

from __future__ import annotations

import ctypes
import errno
import os
import signal
import sys
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.experiments.studies import local_workers, trial
from pilotage.experiments.studies.trial import Outcome

ORDERS, MARKS = "HOSTILE_TRIALS", "HOSTILE_MARKS"
"""Environment: ``row:how,row:how``, and a folder that remembers which rows ran how often."""


def work(pipe: Connection, base: Mapping[str, Any], memory_bytes: int) -> None:
    """In the place of a worker's life: the same, with trials that obey the orders."""
    if "unborn" in os.environ[ORDERS]:
        os._exit(7)
    trial.measured = instead
    local_workers._work(pipe, base, memory_bytes)


def sweep(folder: Path, workers: int) -> int:
    """The command whose trials obey the orders: three radii, six seeds, as the study ``x`` in ``folder``."""
    from pilotage.cli.main import main

    local_workers._work = work
    words = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5,0.8", "--trials", "6"]
    words += ["--name", "x", "--no-report", "--quiet", "--out", str(folder), "--workers", str(workers)]
    sys.argv[1:] = words
    return main()


def instead(row: int, mission: Any) -> Outcome:
    """In the place of a run: the row's order, else a number that its seed and radius give."""
    orders = dict(order.split(":") for order in os.environ[ORDERS].split(",") if order)
    mark = Path(os.environ[MARKS]) / f"{row}-{os.getpid()}-{time.monotonic_ns()}"
    mark.touch()
    how = orders.get(str(row), "well")
    if how.endswith("-once"):
        how = how.removesuffix("-once") if len(list(mark.parent.glob(f"{row}-*"))) == 1 else "well"
    misbehave(how)
    radius = mission.stack.planner.model_dump()["turning_radius_m"]
    return Outcome(row, {"planned_length_m": 1000.0 * radius + mission.run.seed}, {}, seconds=0.001)


def misbehave(how: str) -> None:
    """Do what is ordered; ``well`` does nothing."""
    if how == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    elif how == "segv":
        ctypes.string_at(0)
    elif how == "sysexit":
        sys.exit(4)
    elif how == "memory":
        raise MemoryError
    elif how == "full":
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/somewhere/trace.parquet")
    elif how == "bug":
        raise ZeroDivisionError("a\nbug")
    elif how == "deep":
        misbehave(how)
    elif how == "swell":
        held = []
        while True:
            held.append(np.empty(1 << 28, np.uint8))  # not written to: two gigabytes take seconds to fill
    elif how == "slow":
        time.sleep(600)
