"""What wheel odometry told since the last row of the trace, where rows are kept more rarely than it reads."""

from __future__ import annotations

import math

from pilotage.core.angles import wrap_to_pi
from pilotage.kernels.geometry.motion import chord_ratio
from pilotage.sensors.readings import OdometryIncrement

NONE = (math.nan, math.nan, math.nan)


class OdometrySince:
    """Joins increments to one: the arc, with its shift to the left, that ends where they do in turn.

    Distance and shift are the logarithm of the motion (SE(2)), so that a row tells one increment as a reading
    does. A turn is told within half a circle either way.
    """

    def __init__(self) -> None:
        self._last: OdometryIncrement | None = None
        self._count = 0
        self._x = self._y = self._theta = 0.0

    def add(self, reading: OdometryIncrement) -> None:
        """Go on by a reading."""
        self._last = reading
        self._count += 1
        half = 0.5 * reading.angle_rad
        chord = chord_ratio(reading.angle_rad)
        ahead, left = chord * reading.distance_m, chord * reading.lateral_m
        c, s = math.cos(self._theta + half), math.sin(self._theta + half)
        self._x += c * ahead - s * left
        self._y += s * ahead + c * left
        self._theta += reading.angle_rad

    @property
    def pose(self) -> tuple[float, float, float]:
        """Where the joined increments lead from the origin."""
        return self._x, self._y, self._theta

    def take(self) -> tuple[float, float, float]:
        """Distance, turn and shift to the left since this was asked last; nan without a reading."""
        if self._last is None:
            return NONE
        last, count, theta = self._last, self._count, wrap_to_pi(self._theta)
        half, chord = 0.5 * theta, chord_ratio(theta)
        c, s = math.cos(half), math.sin(half)
        ahead, left = (c * self._x + s * self._y) / chord, (c * self._y - s * self._x) / chord
        self._last, self._count = None, 0
        self._x = self._y = self._theta = 0.0
        # A single reading as it is, to the last bit.
        return (last.distance_m, last.angle_rad, last.lateral_m) if count == 1 else (ahead, theta, left)
