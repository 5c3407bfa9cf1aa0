"""Tracks of pedestrians, one annotation a line (frame, person, x, y), as bodies that move in time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.text import check_size, read_table

FRAMES_PER_S = 25.0
RADIUS_M = 0.25
COLUMNS = ("frame", "person", "x", "y")


@dataclass(frozen=True, slots=True)
class PeopleTracks:
    """People's places over time, by person and then time.

    Attributes
    ----------
    person, t_s, places_xy_m
        (N,), (N,), (N, 2) annotations; the time begins at the first of all.
    """

    person: IntArray
    t_s: FloatArray
    places_xy_m: FloatArray

    @property
    def duration_s(self) -> float:
        """Time of the last annotation."""
        return float(self.t_s.max())

    def at(self, t_s: float) -> tuple[FloatArray, FloatArray]:
        """Places (K, 2) and velocities (K, 2) of those who are there, straight between their annotations.

        A person is there from its first annotation to its last.
        """
        begins = np.flatnonzero(self.person[1:] == self.person[:-1])
        inside = begins[(self.t_s[begins] <= t_s) & (t_s < self.t_s[begins + 1])]
        span = (self.t_s[inside + 1] - self.t_s[inside])[:, None]
        step = self.places_xy_m[inside + 1] - self.places_xy_m[inside]
        places = self.places_xy_m[inside] + (t_s - self.t_s[inside])[:, None] / span * step
        return places, step / span

    def discs_at(self, t_s: float, radius_m: float = RADIUS_M) -> FloatArray:
        """Discs (K, 3) x, y, radius of those who are there."""
        places, _ = self.at(t_s)
        return np.column_stack([places, np.full(places.shape[0], radius_m)])


def read_people(path: Path) -> PeopleTracks:
    """Read a file of tracks.

    Raises
    ------
    InputError
        File and line of what is no number, of a frame or person that is no whole number, of a person who is
        at two places at once; a file in which nobody is seen twice.
    """
    table = read_table(path, COLUMNS)
    check_size(table, COLUMNS, first=2)
    for column in range(2):
        values = table.values[:, column]
        wrong = np.flatnonzero((values != np.floor(values)) | (np.abs(values) > 1e9))
        if wrong.size:
            row = int(wrong[0])
            raise InputError(
                f"{table.place(row)}: {COLUMNS[column]}: expected a whole number, found {values[row]:g}"
            )
    order = np.lexsort((table.values[:, 0], table.values[:, 1]))
    rows = table.values[order]
    person = rows[:, 1].astype(np.int64)
    t_s = (rows[:, 0] - rows[:, 0].min()) / FRAMES_PER_S
    same = person[1:] == person[:-1]
    twice = np.flatnonzero(same & (np.diff(t_s) <= 0.0))
    if twice.size:
        row = int(order[int(twice[0]) + 1])
        raise InputError(
            f"{table.place(row)}: person {int(table.values[row, 1])} is there twice in frame "
            f"{int(table.values[row, 0])}; keep one of the lines"
        )
    if not same.any():
        raise InputError(f"{path}: expected people seen twice or more, found none")
    return PeopleTracks(person, t_s, np.ascontiguousarray(rows[:, 2:4]))
