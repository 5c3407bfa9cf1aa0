"""Numbers out of files: what is none, or larger than anything measured, is NaN; no warning ever follows."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.misfit import LARGEST
from pilotage.core.types import FloatArray

Pose = tuple[float, float, float | None]
"""x and y in metres and a heading in radians, None where it is free."""


def number(value: object) -> float:
    """Return a float; NaN for None, for what is no number and for what is beyond ``LARGEST``.

    null stands for NaN in JSON, and an integer there may have a thousand digits.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        return math.nan
    try:
        found = float(value)
    except OverflowError:
        return math.nan
    return found if abs(found) <= LARGEST else math.nan


def table(rows: object, width: int) -> FloatArray:
    """Return rows of a JSON table of places as (n, width); empty where there are none.

    Raises
    ------
    ValueError
        Where it is no list of lists of ``width`` numbers, or a number lies beyond ``FARTHEST_M``.
    """
    if rows is None:
        return np.empty((0, width))
    if not isinstance(rows, list):
        raise ValueError(f"expected rows of {width} numbers, found {type(rows).__name__}")
    for index, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != width:
            raise ValueError(f"row {index}: expected {width} numbers, found {_shown(row)}")
        for value in row:
            place(value, f"row {index}")
    return np.array(rows, dtype=np.float64).reshape(-1, width)


def place(value: object, where: str) -> float:
    """Return a coordinate or a length.

    Raises
    ------
    ValueError
        Where it is no number within ``FARTHEST_M``.
    """
    found = number(value)
    if not abs(found) <= FARTHEST_M:
        raise ValueError(f"{where}: expected numbers within {FARTHEST_M:g}, found {_shown(value)}")
    return found


def pose(values: object, where: str) -> Pose | None:
    """Return x, y and the heading of a JSON list; None where there is no list of two or three.

    Raises
    ------
    ValueError
        Where a coordinate is no number within ``FARTHEST_M``.
    """
    if values is None:
        return None
    if not isinstance(values, list) or not 2 <= len(values) <= 3:
        raise ValueError(f"{where}: expected x, y and a heading, found {_shown(values)}")
    theta = number(values[2]) if len(values) > 2 else math.nan
    heading = theta if abs(theta) <= FARTHEST_M else None
    return place(values[0], where), place(values[1], where), heading


def _shown(value: object) -> str:
    """A short word for what was found."""
    if isinstance(value, list | dict):
        return f"{type(value).__name__} of {len(value)}"
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 10**18:
        return "a huge number"
    return ascii(value)[:40]
