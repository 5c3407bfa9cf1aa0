"""Tracks of pedestrians, one annotation a line (frame, person, x, y), as bodies that move in time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.text import check_size, read_table

FRAME_RATE_HZ = 25.0
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

    def at(self, t_s: float) -> tuple[IntArray, FloatArray]:
        """Rows (K,) of the last annotations of those who are there, and their places (K, 2) by now.

        Straight between annotations; a person is there from its first one to its last.
        """
        rows = np.flatnonzero(self.person[1:] == self.person[:-1])
        rows = rows[(self.t_s[rows] <= t_s) & (t_s < self.t_s[rows + 1])]
        share = (t_s - self.t_s[rows]) / (self.t_s[rows + 1] - self.t_s[rows])
        places = self.places_xy_m[rows]
        return rows, places + share[:, None] * (self.places_xy_m[rows + 1] - places)

    def speeds_m_s(self, rows: IntArray) -> FloatArray:
        """(K,) how fast they walk on from annotations that are not their last ones."""
        step = self.places_xy_m[rows + 1] - self.places_xy_m[rows]
        return np.hypot(step[:, 0], step[:, 1]) / (self.t_s[rows + 1] - self.t_s[rows])

    def slots(self, apart_s: float) -> IntArray:
        """(N,) a small number for each annotation's person, another one for who is there at the same time.

        Who comes more than ``apart_s`` after another one has left may have the same number.
        """
        starts = np.flatnonzero(np.diff(self.person, prepend=self.person[0] - 1))
        ends = np.append(starts[1:], len(self.person)) - 1
        out = np.empty(len(self.person), dtype=np.int64)
        free_from: list[float] = []
        for k in np.argsort(self.t_s[starts], kind="stable"):
            begin = float(self.t_s[starts[k]])
            slot = next((n for n, free in enumerate(free_from) if free < begin), len(free_from))
            if slot == len(free_from):
                free_from.append(0.0)
            free_from[slot] = float(self.t_s[ends[k]]) + apart_s
            out[starts[k] : ends[k] + 1] = slot
        return out


def read_people(path: Path, frame_rate_hz: float = FRAME_RATE_HZ) -> PeopleTracks:
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
    t_s = (rows[:, 0] - rows[:, 0].min()) / frame_rate_hz
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
