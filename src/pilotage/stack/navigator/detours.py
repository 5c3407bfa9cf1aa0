"""What a way around may cost: less than the narrow way that it saves."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Detours:
    """How much farther a robot goes for more room.

    Attributes
    ----------
    wider_m
        For a greater clearance; inf: as far as it takes, and smaller clearances are for want of a path only.
    tight_m
        What leaves a body less than this to spare, on both sides together, it squeezes through.
    squeezing_m
        So much farther it goes, beyond ``wider_m``, not to squeeze through between what it found.
    hidden_m
        What was found on the way may reach by up to so much farther than it was seen to.
    look_m
        Gaps that what is hidden may close it drives up to from so near: a look costs twice that at most.
    """

    wider_m: float = math.inf
    tight_m: float = 0.0
    squeezing_m: float = 0.0
    hidden_m: float = 0.0
    look_m: float = 0.0


AS_FAR_AS_IT_TAKES = Detours()
