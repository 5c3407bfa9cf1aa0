"""Who truly was at which vertex of a patrol graph, and when."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.idleness import Idleness, idleness

STAYS_S = 1.0
"""Who stays visits again so often: a place where somebody stands is not idle."""


class VisitLog:
    """Keeps arrivals, stays and departures; all vertices count as visited at the beginning.

    Attributes
    ----------
    last_s
        (V,) when each was last visited.
    """

    def __init__(self, vertices_xy_m: FloatArray, visit_m: float, robots: int) -> None:
        self._places, self._visit_m = vertices_xy_m, visit_m
        self.last_s: FloatArray = np.zeros(len(vertices_xy_m))
        self._there = np.zeros((robots, len(vertices_xy_m)), dtype=np.bool_)
        self._arrivals: list[tuple[int, int, float]] = []
        self._stays: list[tuple[int, float]] = []
        self._said_s: FloatArray = np.full(len(vertices_xy_m), -np.inf)

    def add(self, t_s: float, places_xy_m: FloatArray, works: BoolArray) -> None:
        """Robots (N, 2) are here now; the body of one that does not work (N,) guards no place."""
        dx = places_xy_m[:, :1] - self._places[:, 0]
        dy = places_xy_m[:, 1:] - self._places[:, 1]
        there = (dx * dx + dy * dy <= self._visit_m**2) & works[:, None]
        changed = there != self._there
        if changed.any():
            for robot, vertex in np.argwhere(changed).tolist():
                if there[robot, vertex]:
                    self._arrivals.append((robot, vertex, t_s))
                else:
                    self._stays.append((vertex, float(self.last_s[vertex])))
            self._there = there
        anybody = there.any(axis=0)
        self.last_s[anybody] = t_s
        again = np.flatnonzero(anybody & (t_s - self._said_s >= STAYS_S))
        self._said_s[again] = t_s
        self._stays += [(vertex, t_s) for vertex in again.tolist()]

    def nearest(self, x_m: float, y_m: float) -> int:
        """The vertex nearest to a place; -1 where it is at none."""
        away = np.hypot(self._places[:, 0] - x_m, self._places[:, 1] - y_m)
        best = int(np.argmin(away))
        return best if away[best] <= self._visit_m else -1

    def arrivals(self) -> FloatArray:
        """(K, 3) robot, vertex and time of every arrival, in order."""
        return np.array(self._arrivals, dtype=np.float64).reshape(-1, 3)

    def idleness(self, end_s: float, warm_s: float) -> tuple[Idleness, int]:
        """Idleness from ``warm_s`` on, and how often the vertex that was visited least was come to.

        Where somebody stayed, though nobody came, that is once.
        """
        arrivals = self.arrivals()
        count = len(self.last_s)
        stays = [(float(v), t) for v, t in self._stays]
        # Who is there at the end has been there since it came.
        stays += [(float(v), float(self.last_s[v])) for v in np.flatnonzero(self._there.any(axis=0))]
        marks = np.concatenate([arrivals[:, 1:], np.array(stays).reshape(-1, 2)])
        found = idleness(marks[:, 0].astype(np.int64), marks[:, 1], count, end_s, warm_s=warm_s)
        counted = arrivals[arrivals[:, 2] >= warm_s, 1].astype(np.int64)
        visits = np.bincount(counted, minlength=count)
        stayed = [vertex for vertex, t in self._stays if t >= warm_s]
        visits[stayed] = np.maximum(visits[stayed], 1)
        return found, int(visits.min())
