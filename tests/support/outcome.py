"""A command run in this process and what became of it: code, lines, processor time, memory, what is left."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from numba.core import event

from pilotage.cli.main import main

CPU_S = 30.0
"""Processor time after which a command counts as hung, compiling apart: many times what the slowest takes."""
WALL_S = 1800.0
"""For what waits without working, such as for a pipe that nobody writes; slow machines take less."""
MEMORY_MB = 1000
"""What a damaged input may take beyond what the process holds anyway."""
LONGEST_LINE = 1600


class Hung(BaseException):
    """Raised where a command takes too long; no handler of a command takes it for its own."""


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    code: int
    out: str
    err: str
    grown_mb: float
    cpu_s: float
    new: tuple[str, ...]
    """Files and folders that were not there before, below the working folder."""

    def faults(self) -> list[str]:
        """What it did that no command may do, whatever it is given."""
        found = []
        if self.code not in (0, 1, 2):
            last = self.err.strip().splitlines()[-8:]
            found.append(f"exit code {self.code}: {' | '.join(last)}")
        lines = self.err.splitlines()
        if self.code == 2:
            if len(lines) != 1:
                found.append(f"{len(lines)} lines on standard error: {self.err[-400:]!r}")
            elif not lines[0].startswith("pilotage: ") or len(lines[0]) > LONGEST_LINE:
                found.append(f"a line of {len(lines[0])} characters: {lines[0][:200]!r}")
            # The rows of a damaged study are told of, with where they are now.
            left = [name for name in self.new if not (name.endswith("-salvaged.csv") and name in self.err)]
            if left:
                found.append(f"left behind: {', '.join(left[:5])}")
        if any("Warning" in line for line in lines):
            found.append(f"a warning: {self.err[:300]!r}")
        for name, text in (("output", self.out), ("error", self.err)):
            wild = {c for c in text if not c.isprintable() and c != "\n"}
            if wild:
                found.append(f"control characters on standard {name}: {sorted(wild)}")
        if self.grown_mb > MEMORY_MB:
            found.append(f"{self.grown_mb:.0f} MB of memory")
        hidden = [name for name in self.new if Path(name).name.startswith(".") and ".cache" not in name]
        if hidden:
            found.append(f"a draft left behind: {', '.join(hidden)}")
        return found


def run(words: Sequence[str], folder: Path) -> Outcome:
    """Run ``pilotage WORDS`` in ``folder``; a command that hangs has exit code -1 and says so."""
    before = set(_below(folder))
    here = Path.cwd()
    out, err = _Stream(), _Stream()
    forget_peak()
    held, begun_s = peak_mb(), time.process_time()
    os.chdir(folder)
    try:
        with (
            _beneath(err),
            limited(),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            try:
                code = main(list(words))
            except Hung as limit:
                code = -1
                err.write(f"hung: {limit}")
            except SystemExit as stop:
                code = -2
                err.write(f"SystemExit {stop.code}")
    finally:
        os.chdir(here)
    taken_s = time.process_time() - begun_s
    new = tuple(sorted(set(_below(folder)) - before))
    return Outcome(code, out.getvalue(), err.getvalue(), max(0.0, peak_mb() - held), taken_s, new)


class _Stream(io.StringIO):
    """As a terminal's stream: half characters are question marks, not errors."""

    def write(self, text: str) -> int:
        return super().write(text.encode("utf-8", "replace").decode("utf-8", "replace"))


@contextlib.contextmanager
def _beneath(err: io.StringIO) -> Iterator[None]:
    """What libraries in C write to the process's own standard error is said as well."""
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            err.write(file.read(10_000).decode("utf-8", "replace"))


@contextlib.contextmanager
def limited() -> Iterator[None]:
    """End what takes too long: by processor time, which others do not take away, and by the clock."""

    def ended(signum: int, frame: object) -> None:  # noqa: ARG001 - as signal calls it
        raise Hung(f"more than {CPU_S:g} s of processor time or {WALL_S:g} s")

    before = {number: signal.signal(number, ended) for number in (signal.SIGPROF, signal.SIGUSR2)}
    signal.setitimer(signal.ITIMER_PROF, CPU_S)
    timer = _Timer(WALL_S)
    try:
        with event.install_listener("numba:compile", _Compiling()):
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        timer.stop()
        for number, handler in before.items():
            signal.signal(number, handler)


class _Compiling(event.Listener):
    """Stops the count of processor time meanwhile: which command compiles what depends on what ran before."""

    _depth, _left_s = 0, 0.0

    def on_start(self, _: object) -> None:
        if self._depth == 0:
            self._left_s, _interval_s = signal.setitimer(signal.ITIMER_PROF, 0.0)
        self._depth += 1

    def on_end(self, _: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            signal.setitimer(signal.ITIMER_PROF, max(self._left_s, 1e-3))


class _Timer:
    """Sends SIGUSR2 after a while: the command itself has a use for SIGALRM."""

    def __init__(self, after_s: float) -> None:
        import threading

        self._timer = threading.Timer(after_s, os.kill, (os.getpid(), signal.SIGUSR2))
        self._timer.daemon = True
        self._timer.start()

    def stop(self) -> None:
        self._timer.cancel()


def _below(folder: Path) -> Iterator[str]:
    for root, folders, files in os.walk(folder):
        for name in [*folders, *files]:
            yield str((Path(root) / name).relative_to(folder))


def forget_peak() -> None:
    """Let the kernel count the largest size anew, where it can."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_mb() -> float:
    """The largest size of this process since then."""
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1000.0
    except OSError:
        pass
    return 0.0


if __name__ == "__main__":  # one command in a process of its own, for those under a limit of memory
    sys.exit(main(sys.argv[1:]))
