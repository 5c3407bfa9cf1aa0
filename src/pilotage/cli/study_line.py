"""What a study says on standard error while it runs: how far it is, and what went wrong on the way."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from pilotage.core.shown import visible

if TYPE_CHECKING:
    from pilotage.experiments.studies.engine import StudyProgress

TROUBLES = 20
"""So many lines are read; a thousand are not."""


class StudyLine:
    """How far the study is, on standard error."""

    def __init__(self, quiet: bool) -> None:
        from time import monotonic

        self._clock = monotonic
        self._quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._period_s = 0.2 if self._terminal else 10.0
        self._next_s = monotonic() + (0.0 if self._terminal else self._period_s)
        self._drawn = False
        self._troubles = 0

    def __call__(self, progress: StudyProgress) -> None:
        now_s = self._clock()
        if self._quiet or now_s < self._next_s:
            return
        self._next_s = now_s + self._period_s
        counts = progress.counts
        left = f"{progress.left_s:.0f} s left" if progress.left_s < 1e9 else "no rate yet"
        failed = f", {counts.failed} failed" if counts.failed else ""
        ended = counts.done + counts.failed
        text = f"{ended} of {counts.total} trials{failed}, {progress.rate_per_s:.1f}/s, {left}"
        print(
            f"\r{text}\x1b[K" if self._terminal else text, end="" if self._terminal else "\n", file=sys.stderr
        )
        sys.stderr.flush()
        self._drawn = self._terminal

    def trouble(self, text: str) -> None:
        """Say what went wrong on the way, as long as it is worth reading."""
        self._troubles += 1
        if self._troubles <= TROUBLES:
            self.tell(text)
        elif self._troubles == TROUBLES + 1:
            self.tell("more of that kind: see the reasons in trials.csv")

    def tell(self, text: str) -> None:
        """Say one line that stays."""
        self.close()
        print(f"pilotage: {visible(text)}", file=sys.stderr)

    def close(self) -> None:
        """Wipe the line."""
        if self._drawn:
            print("\r\x1b[K", end="", file=sys.stderr)
            self._drawn = False
