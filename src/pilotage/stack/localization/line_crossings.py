"""From what a line sensor says to points on a tape's centre line or on the sheet's edge."""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]

CHORD = (0.5, 2.2)
"""Chords of a tape in its widths: shorter ones are corners and ends, longer ones drives along it."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where a line was crossed, on the map, and whether it is the sheet's edge."""

    at: Point
    edge: bool


class CrossingDetector:
    """Follows one line sensor.

    The middle between the points where it turns dark and bright again lies on the tape's centre line,
    however slanted the crossing. At the sheet's edge each change by itself is a point of the edge.

    Parameters
    ----------
    size_m
        Width and height of the sheet.
    edge_is_dark
        Whether the sensor reads dark beyond the edge.
    """

    def __init__(self, tape_width_m: float, size_m: tuple[float, float], edge_is_dark: bool) -> None:
        self._width, self._size, self._edge_is_dark = tape_width_m, size_m, edge_is_dark
        self._was_dark = False
        self._was_at: Point | None = None
        self._entered: Point | None = None

    @property
    def is_dark(self) -> bool:
        """What it read last."""
        return self._was_dark

    def step(self, dark: bool, at: Point, position_std_m: float) -> Crossing | None:
        """Take in one reading made at a point of the map."""
        before, self._was_at = self._was_at, at
        changed, self._was_dark = dark != self._was_dark, dark
        if before is None or not changed:
            return None
        change = 0.5 * (before[0] + at[0]), 0.5 * (before[1] + at[1])
        width, height = self._size
        inside = min(change[0], change[1], width - change[0], height - change[1])
        if self._edge_is_dark and inside < min(max(0.03, 4.0 * position_std_m), 0.06):
            self._entered = None
            return Crossing(change, edge=True)
        if dark:
            self._entered = change
            return None
        entered, self._entered = self._entered, None
        if entered is None:
            return None
        chord = math.hypot(change[0] - entered[0], change[1] - entered[1])
        if not CHORD[0] * self._width < chord < CHORD[1] * self._width:
            return None
        return Crossing((0.5 * (entered[0] + change[0]), 0.5 * (entered[1] + change[1])), edge=False)
