"""Where a run stands: one line that rewrites itself, on a terminal or in a notebook's cell."""

from __future__ import annotations

import html
import importlib
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TextIO

from pilotage.experiments.progress import Progress


def progress_text(progress: Progress) -> str:
    """One line: simulated time and the numbers of a run of its kind."""
    words = [f"t {progress.t_s:>6.1f} s", *(f"{label} {text}" for label, text in progress.numbers)]
    return "   ".join(words)


class Shown(Protocol):
    """Shows progress until it is closed."""

    def __call__(self, progress: Progress) -> None:
        """Show it, if it is time for it."""

    def close(self) -> None:
        """Wipe what was shown."""


class StatusLine:
    """One line on standard error that rewrites itself on a terminal.

    Elsewhere a plain line from time to time, so that a log shows life and stays short.

    Parameters
    ----------
    stream
        Standard error.
    clock_s
        A monotonic clock.
    period_s
        Between two texts on a terminal.
    """

    _LOG_PERIOD_S = 10.0

    def __init__(
        self, stream: TextIO, clock_s: Callable[[], float] = time.monotonic, period_s: float = 0.1
    ) -> None:
        self._stream = stream
        self._clock_s = clock_s
        self._terminal = stream.isatty() and os.environ.get("TERM") != "dumb"
        self._period_s = period_s if self._terminal else self._LOG_PERIOD_S
        self._next_s = clock_s() + (0.0 if self._terminal else self._period_s)
        self._drawn = False

    def is_due(self) -> bool:
        """Whether it is time for another text; counts from now on if so."""
        now_s = self._clock_s()
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self._period_s
        return True

    def show(self, text: str) -> None:
        """Show a text in the place of the last one."""
        self._stream.write(f"\r{text}\x1b[K" if self._terminal else f"{text}\n")
        self._stream.flush()
        self._drawn = self._terminal

    def close(self) -> None:
        """Wipe the line."""
        if self._drawn:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._drawn = False


class ProgressLine(StatusLine):
    """Where a run stands, on standard error."""

    def __call__(self, progress: Progress) -> None:
        """Show ``progress`` if it is time for it."""
        if self.is_due():
            self.show(progress_text(progress))


class NotebookLine:
    """Where a run stands, in the output of a notebook's cell."""

    def __init__(self, display: Callable[..., Any], limit_s: float) -> None:
        self._display, self._limit_s = display, limit_s
        self._handle: Any = None

    def __call__(self, progress: Progress) -> None:
        """Show ``progress``: a bar of the time that the mission may take, and the numbers."""
        shown = {"text/html": self._html(progress), "text/plain": progress_text(progress)}
        if self._handle is None:
            self._handle = self._display(shown, raw=True, display_id=True)
        else:
            self._handle.update(shown, raw=True)

    def close(self) -> None:
        """Leave an empty place."""
        if self._handle is not None:
            self._handle.update({"text/html": "", "text/plain": ""}, raw=True)
            self._handle = None

    def _html(self, progress: Progress) -> str:
        bar = f'<progress max="{self._limit_s:g}" value="{progress.t_s:g}"></progress>'
        return f"{bar} <code>{html.escape(progress_text(progress))}</code>"


def _notebook_display() -> Callable[..., Any] | None:
    """How a notebook shows something, or None outside of one."""
    ipython = sys.modules.get("IPython")  # where it is not imported there is no notebook
    shell = None if ipython is None else ipython.get_ipython()
    if shell is None or not hasattr(shell, "kernel"):
        return None
    found: Callable[..., Any] = importlib.import_module("IPython.display").display
    return found


@contextmanager
def showing_progress(wanted: bool | None, limit_s: float) -> Iterator[Callable[[Progress], None] | None]:
    """Yield what shows a run's progress, or None; what was shown is gone afterwards, whatever happened.

    Parameters
    ----------
    wanted
        None: on a terminal and in a notebook only.
    limit_s
        The longest that the run may take, in simulated seconds.
    """
    if wanted is False:
        yield None
        return
    display = _notebook_display()
    line: Shown
    if display is not None:
        line = NotebookLine(display, limit_s)
    elif wanted or (sys.stderr is not None and sys.stderr.isatty()):
        line = ProgressLine(sys.stderr)
    else:
        yield None
        return
    try:
        yield line
    finally:
        line.close()
