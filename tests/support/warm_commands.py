"""Commands in processes of their own that do not import anew what all of them need.

They are forked from the server of ``warm_workers``. From there on each is a user's process: its words,
environment and folder, its streams, signals and exit code, nothing registered but what pilotage brings, its
workers spawned. What comes before is asked of commands that are started as users start them
(``test_cli_process``, ``test_quick_refusals``, ``test_signals``, ``test_ten_minutes``, ``test_wheel``).
"""

from __future__ import annotations

import importlib
import multiprocessing.process
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pilotage.core import plugins
from pilotage.experiments.roles import ROLES
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS
from support.warm_workers import WarmProcess, warm_context

LONGEST_S = 1800.0
"""Longer than any command that a test starts takes on the slowest machine."""


@dataclass(frozen=True, slots=True)
class Started:
    """A command under way, and the file that holds what it says on its two streams."""

    process: WarmProcess
    out: Path
    err: Path

    @property
    def pid(self) -> int:
        """Its number."""
        assert self.process.pid is not None
        return self.process.pid

    @property
    def over(self) -> bool:
        """Whether it has ended."""
        return self.process.exitcode is not None

    def line(self, number: int) -> str:
        """A line of its standard output, as soon as it is there; what there is of it where it ended."""
        while True:
            over = self.over
            lines = self.out.read_text(encoding="utf-8").splitlines(keepends=True)
            if over or (len(lines) > number and lines[number].endswith("\n")):
                return "".join(lines[number : number + 1])
            time.sleep(0.005)

    def ended(self) -> subprocess.CompletedProcess[str]:
        """Wait for it; the exit code is negative where a signal ended it.

        One that hangs is killed, and told: a suite that waits for it for ever tells nobody anything.
        """
        self.process.join(LONGEST_S)
        if self.process.exitcode is None:
            self.process.kill()
            raise AssertionError(f"still running after {LONGEST_S:g} s: {self.err.read_text()[-2000:]}")
        told = (stream.read_text(encoding="utf-8") for stream in (self.out, self.err))
        return subprocess.CompletedProcess((), self.process.exitcode, *told)


def pilotage(
    *words: str, folder: Path, site: Path | None = None, rooms: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run ``pilotage WORDS`` in ``folder`` without this process's plugins.

    ``site`` is first on its path; what stands in ``rooms`` is as if it stood in pilotage's.
    """
    with tempfile.TemporaryDirectory(prefix="pilotage-command-") as place:
        return start(Path(place), _command, words, site, rooms, folder=folder).ended()


def start(place: Path, act: Callable[..., int], *given: object, folder: Path) -> Started:
    """Call ``act(*given)`` in a process and session of its own; ``place`` takes its streams."""
    place.mkdir(exist_ok=True)
    streams = place / "out", place / "err"
    for stream in streams:
        stream.touch()
    process = warm_context().Process(target=_alone, args=(act, given, folder, streams))
    process.start()
    return Started(process, *streams)


def _alone(
    act: Callable[..., int], given: tuple[object, ...], folder: Path, streams: tuple[Path, Path]
) -> None:
    os.setsid()
    for number, stream in enumerate(streams, start=1):
        opened = os.open(stream, os.O_WRONLY | os.O_APPEND)
        os.dup2(opened, number)
        os.close(opened)
    os.chdir(folder)
    # Nobody's worker, started as by ``python -c``: its own workers have no script to import.
    multiprocessing.process._parent_process = None  # type: ignore[attr-defined]
    sys.modules["__main__"] = ModuleType("__main__")
    sys.exit(act(*given))


def _command(words: tuple[str, ...], site: Path | None, rooms: Path | None) -> int:
    os.environ.pop(plugins.VARIABLE, None)
    sys.path.insert(0, "" if site is None else str(site))
    importlib.invalidate_caches()
    if rooms is not None:
        for room in {path.parent for path in rooms.rglob("*.py")}:
            package = ".".join(["pilotage", *room.relative_to(rooms).parts])
            importlib.import_module(package).__path__.append(str(room))
    # It has not looked for installed packages yet.
    plugins._seen_entry_points = False
    registries: list[Any] = [*ROLES.values(), SIMULATED_SENSORS, SIMULATED_MOTIONS]
    for registry in registries:
        registry._loaded = False
    from pilotage.cli.main import main

    sys.argv = ["pilotage", *words]
    return main()
