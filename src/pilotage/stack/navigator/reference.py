"""A path laid out in time, whose clock runs slower where the robot has to wait."""

from __future__ import annotations

import math
from enum import Enum, auto

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import BoolArray, FloatArray, IntArray

STANDS = 0.02
"""A clock slower than this stands."""


class Ends(Enum):
    """What a corner of a reference ends."""

    NEITHER = auto()
    LINE = auto()
    TURN = auto()


class Reference:
    """Rows of ``timed_path.laid_out``: where to be at the end of each step, and with which speeds.

    Attributes
    ----------
    rate
        How fast its clock runs; 1: by the layout.
    """

    def __init__(self, rows: FloatArray, dt_s: float) -> None:
        self._rows, self._dt_s = rows, dt_s
        direction = np.sign(rows[:, 3])
        self._corners = _changes(direction != 0.0)
        self._turns = _changes(direction)
        self._at, self._before, self.rate = 0.0, 0.0, 1.0
        ahead_m = dt_s * np.abs(rows[::-1, 3]).cumsum()[::-1]
        self._to_go_m = np.append(ahead_m, 0.0)

    @property
    def done(self) -> bool:
        """Whether it was driven to its end."""
        return self._at >= len(self._rows)

    @property
    def speed_m_s(self) -> float:
        """Of the layout here, negative backwards."""
        return 0.0 if self.done else float(self._rows[int(self._at), 3])

    def ahead(self, within_m: float, within_s: float) -> FloatArray:
        """(K, 3) from where the reference is, in one direction, as far as this or to where it rests.

        Of a turn on the spot as much as is made in ``within_s``.
        """
        if self.done:
            return self.pose()[None, :]
        first = int(self._at)
        count = _next(self._turns, first) - first
        if self._rows[first, 3] == 0.0:
            count = min(count, math.ceil(within_s / self._dt_s))
        else:
            along_m = self._dt_s * np.abs(self._rows[first : first + count, 3]).cumsum()
            count = min(count, int(np.searchsorted(along_m, within_m)) + 1)
        return np.vstack([self.pose(), self._rows[first : first + count, :3]])

    @property
    def ends(self) -> Ends:
        """What ends where it is: a line, a turn on the spot, or neither."""
        index = int(self._at)
        if index == 0 or self._at != index or index not in self._corners:
            return Ends.NEITHER
        return Ends.TURN if self._rows[index - 1, 3] == 0.0 else Ends.LINE

    def hold(self) -> FloatArray:
        """(6,) as ``step``, but its clock stands: pose, no speeds, and the way to go."""
        self._before = self._at
        return np.array([*self.pose(), 0.0, 0.0, self._rest_m()])

    def step(self) -> FloatArray:
        """Move on by a step of its clock: (6,) pose, speed, turn rate and the way to go from there.

        Where a line or a turn on the spot ends it stops in any case.
        """
        row = self._rows[int(self._at)]
        v, w = self.rate * row[3], self.rate * row[4]
        self._before = self._at
        corner = float(_next(self._corners, self._at))
        self._at = min(self._at + self.rate, corner)
        if corner - self._at < STANDS:
            self._at = corner
        return np.array([*self.pose(), v, w, self._rest_m()])

    def stay(self) -> None:
        """Take the last step back: it was not driven. The clock starts anew."""
        self._at, self.rate = self._before, 0.0

    def _rest_m(self) -> float:
        """The way to go from where it is."""
        first = int(self._at)
        here_m, after_m = self._to_go_m[first], self._to_go_m[min(first + 1, len(self._rows))]
        return float(here_m + (self._at - first) * (after_m - here_m))

    def pose(self) -> FloatArray:
        """(3,) where it is: a row's pose at the end of its step, before the first one the first row's."""
        after = self._at - 1.0
        first = max(math.floor(after), 0)
        pose = self._rows[min(first, len(self._rows) - 1), :3].copy()
        share = after - first
        if share > 0.0 and first + 1 < len(self._rows):
            following = self._rows[first + 1, :3]
            pose[:2] += share * (following[:2] - pose[:2])
            pose[2:] = wrap_array_to_pi(pose[2:] + share * wrap_array_to_pi(following[2:] - pose[2:]))
        return pose


def _changes(values: FloatArray | BoolArray) -> IntArray:
    """Rows whose value is another than the one before has, and the number of rows."""
    return np.append(np.flatnonzero(values[1:] != values[:-1]) + 1, len(values))


def _next(rows: IntArray, at: float) -> int:
    """The first of sorted rows that is beyond a place."""
    return int(rows[np.searchsorted(rows, at, side="right")])
