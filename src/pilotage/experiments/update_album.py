"""Updates worth a picture, chosen while the run goes on: a run has hundreds, a reader looks at six."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pilotage.core.scan_update import ScanUpdate
from pilotage.records.updates import KeptUpdate, update_arrays
from pilotage.stack.interface import ExplainableUpdate

APART_S = 3.0
"""Two pictures of the same kind are at least so far apart: the next scan looks like the last."""
MOST_LEFT_OUT = 2
EVENLY = 2


@dataclass(frozen=True, slots=True)
class Picture:
    """An update, when it was, and why it was chosen."""

    t_s: float
    why: str
    score: float
    update: ScanUpdate


class UpdateAlbum:
    """Keeps the first update, those with most lines left out, the farthest that was still accepted, and a
    few evenly spaced ones; its size does not grow with the run."""

    def __init__(self) -> None:
        self._first: list[Picture] = []
        self._left_out: list[Picture] = []
        self._farthest: list[Picture] = []
        self._evenly: list[Picture] = []
        self._stride, self._offered = 1, 0

    def offer(self, t_s: float, update: ExplainableUpdate) -> None:
        """Look at an update; explain and keep it if it is worth it."""
        if not self._first:
            self._first.append(Picture(t_s, "first update", 0.0, update.explained()))
        self._best(self._left_out, MOST_LEFT_OUT, t_s, "most lines left out", float(update.left_out), update)
        if self._offered:  # the first has a start's error to mend: it would always be the farthest
            self._best(self._farthest, 1, t_s, "largest chi-square accepted", update.largest_accepted, update)
        if self._offered % self._stride == 0:
            self._evenly.append(Picture(t_s, "on the way", 0.0, update.explained()))
            if len(self._evenly) > 4 * EVENLY:  # every other one goes, and the rest come half as often
                self._evenly = self._evenly[::2]
                self._stride *= 2
        self._offered += 1

    def _best(
        self, kept: list[Picture], most: int, t_s: float, why: str, score: float, update: ExplainableUpdate
    ) -> None:
        """Keep the ``most`` highest scores above 0 that are apart from each other."""
        if score <= 0.0:
            return
        near = [k for k, picture in enumerate(kept) if t_s - picture.t_s < APART_S]
        rivals = near or ([] if len(kept) < most else [min(range(len(kept)), key=lambda k: kept[k].score)])
        if score <= max((kept[k].score for k in rivals), default=0.0):
            return
        kept[:] = [picture for k, picture in enumerate(kept) if k not in rivals]
        kept.append(Picture(t_s, why, score, update.explained()))

    def pictures(self) -> list[KeptUpdate]:
        """The chosen ones in their order, each update once."""
        inner = np.linspace(0, len(self._evenly) - 1, EVENLY + 2)[1:-1] if self._evenly else np.empty(0)
        evenly = [self._evenly[round(float(k))] for k in inner]
        by_time: dict[float, Picture] = {}
        for picture in (*self._first, *self._left_out, *self._farthest, *evenly):
            by_time.setdefault(picture.t_s, picture)
        chosen = [by_time[t_s] for t_s in sorted(by_time)]
        return [KeptUpdate(picture.t_s, picture.why, picture.update) for picture in chosen]

    def arrays(self) -> Mapping[str, Any]:
        """The pictures as arrays for one file; empty without any."""
        return update_arrays(self.pictures())
