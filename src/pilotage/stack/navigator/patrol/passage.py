"""Somebody in a passage that has room for one."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Passage:
    """Somebody in a passage with room for one.

    Attributes
    ----------
    inside
        Whether the robot itself is in it.
    mouth_m, other_m
        How far ahead it begins, and the other is.
    beyond_m
        From the other to the passage's far end.
    recedes
        Whether the other goes ahead.
    mouth_xy_m, outwards
        (2,) where it begins, and the direction out of it there.
    """

    inside: bool
    mouth_m: float
    other_m: float
    beyond_m: float
    recedes: bool
    mouth_xy_m: FloatArray
    outwards: FloatArray
