"""What a study says on standard error while it runs: how far it is, and what went wrong on the way."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from pilotage.core.shown import visible
from pilotage.face.progress import StatusLine

if TYPE_CHECKING:
    from pilotage.experiments.studies.engine import StudyProgress

TROUBLES = 20
"""So many lines are read; a thousand are not."""


class StudyLine(StatusLine):
    """How far the study is, on standard error."""

    def __init__(self, quiet: bool) -> None:
        super().__init__(sys.stderr, period_s=0.2)
        self._quiet = quiet
        self._troubles = 0

    def __call__(self, progress: StudyProgress) -> None:
        if self._quiet or not self.is_due():
            return
        counts = progress.counts
        left = f"{progress.left_s:.0f} s left" if progress.left_s < 1e9 else "no rate yet"
        failed = f", {counts.failed} failed" if counts.failed else ""
        ended = counts.done + counts.failed
        self.show(f"{ended} of {counts.total} trials{failed}, {progress.rate_per_s:.1f}/s, {left}")

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
