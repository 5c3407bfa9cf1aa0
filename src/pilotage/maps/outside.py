"""What of a map's rectangle lies outside the building that its walls draw."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import BoolArray, FloatArray

SPANS = 0.75
"""Closed rooms that are together so wide and so high, as a share of the map, are the building it is of."""
RIM = 2
"""Spacings from the map's edge: what is no farther from a wall there may be a room's own side."""


def outside_building(
    pieces: NDArray[np.integer[Any]], clearance_m: FloatArray, spacing_m: float
) -> BoolArray:
    """Which cells of a map of walls lie beyond a building that fills the map.

    A map's rectangle holds a turned or an L-shaped building with room to spare. What comes to the edge of the
    map where no wall stands is outside if closed rooms span the map without it; else it is a yard, whose
    boxes are closed as well but span nothing.

    Parameters
    ----------
    pieces
        (rows, columns) labels of floor that is connected, 0 for what is none.
    clearance_m
        (rows, columns) distances from walls; cells beyond the map's edge are no floor.
    """
    outside = np.zeros(pieces.shape, np.bool_)
    rim = np.ones_like(outside)
    rim[RIM:-RIM, RIM:-RIM] = False
    led_out = np.unique(pieces[rim & (clearance_m > RIM * spacing_m)])
    led_out = led_out[led_out > 0]
    if not len(led_out):
        return outside
    outside = np.isin(pieces, led_out)
    closed = (pieces > 0) & ~outside
    spans = all(
        _extent(np.asarray(closed.any(axis=1 - axis))) >= SPANS * closed.shape[axis] for axis in (0, 1)
    )
    return outside if spans else np.zeros_like(outside)


def _extent(marks: BoolArray) -> int:
    """From the first mark to the last."""
    at = np.flatnonzero(marks)
    return int(at[-1] - at[0]) + 1 if len(at) else 0
