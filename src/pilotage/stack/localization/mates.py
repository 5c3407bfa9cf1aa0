"""Whether mates are where they say that they are, seen from where a robot may be."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.scans.missing import count_meetings, meetings

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
        count_meetings(mates, seen, MOST_COUNTED, self._missed, self._met)

    @property
    def speak_against(self) -> bool:
        """Whether they outvote the pose, though scans fit it."""
        missing, met = meetings(self._missed, self._met, MISSING_SCANS)
        return missing >= LEAST_MISSING and missing > met

    def missing(self, scans: int) -> int:
        """How many were missing in so many scans."""
        return meetings(self._missed, self._met, scans)[0]
