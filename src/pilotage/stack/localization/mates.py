"""Whether mates are where they say that they are, seen from where a robot may be."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.scans.missing import MISSING, THERE

NO_MATES: FloatArray = np.zeros((0, 4))
"""Rows as of ``ScanFit.mates_in_sight``."""
LEAST_MISSING, MISSING_SCANS = 2, 25
"""One against one says nothing about who is wrong; more mates that are missing for so long, and more than are
met, speak against a belief that the walls agree with."""
MOST_COUNTED = 50
"""Who was missing for long is believed as soon as anybody else once it is met again."""


class MatesMet:
    """What the scans from one pose, followed over time, said of each mate.

    A mate counts as missing once it was in so many scans more than something was where it may be, which a
    wall or anybody else is too; as met if something was there, and it is not missing. One that says nothing
    any more, or is lost, counts as neither.
    """

    def __init__(self) -> None:
        self._missed: IntArray = np.zeros(0, np.int64)
        self._met = np.zeros(0, np.bool_)

    def take_in(self, mates: FloatArray, seen: IntArray) -> None:
        """One scan: where mates (K, 4) are, and what it says of each (K,); always the same ones in the same
        order."""
        if len(self._missed) != len(mates):
            self._missed, self._met = np.zeros(len(mates), np.int64), np.zeros(len(mates), np.bool_)
        there, gone = seen == THERE, np.isnan(mates[:, 0])
        self._missed += np.where(seen == MISSING, 1, np.where(there, -1, 0))
        self._missed = np.where(gone, 0, self._missed.clip(0, MOST_COUNTED))
        self._met[there] = True
        self._met[gone] = False

    @property
    def speak_against(self) -> bool:
        """Whether they outvote the pose, though scans fit it."""
        missing = self.missing(MISSING_SCANS)
        return missing >= LEAST_MISSING and missing > self.met(MISSING_SCANS)

    def missing(self, scans: int) -> int:
        """How many were missing in so many scans."""
        return int(np.count_nonzero(self._missed >= scans))

    def met(self, scans: int) -> int:
        """How many were met, and not missing in so many scans since."""
        return int(np.count_nonzero(self._met & (self._missed < scans)))
