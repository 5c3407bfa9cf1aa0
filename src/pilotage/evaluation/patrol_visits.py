"""Who truly was at which vertex of a patrol graph, and when."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.idleness import Idleness, idleness


class VisitLog:
    """Keeps arrivals and departures; all vertices count as visited at the beginning.

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
        self._departures: list[tuple[int, float]] = []

    def add(self, t_s: float, places_xy_m: FloatArray) -> None:
        """Robots (N, 2) are here now."""
        dx = places_xy_m[:, :1] - self._places[:, 0]
        dy = places_xy_m[:, 1:] - self._places[:, 1]
        there = dx * dx + dy * dy <= self._visit_m**2
        changed = there != self._there
        if changed.any():
            for robot, vertex in np.argwhere(changed).tolist():
                if there[robot, vertex]:
                    self._arrivals.append((robot, vertex, t_s))
                else:
                    self._departures.append((vertex, float(self.last_s[vertex])))
            self._there = there
        self.last_s[there.any(axis=0)] = t_s

    def arrivals(self) -> FloatArray:
        """(K, 3) robot, vertex and time of every arrival, in order."""
        return np.array(self._arrivals, dtype=np.float64).reshape(-1, 3)

    def idleness(self, end_s: float, warm_s: float) -> tuple[Idleness, int]:
        """Idleness from ``warm_s`` on, and how often the vertex that was visited least was come to."""
        arrivals = self.arrivals()
        count = len(self.last_s)
        stays = [(float(v), t) for v, t in self._departures]
        # Who is there at the end has been there since it came.
        stays += [(float(v), float(self.last_s[v])) for v in np.flatnonzero(self._there.any(axis=0))]
        marks = np.concatenate([arrivals[:, 1:], np.array(stays).reshape(-1, 2)])
        found = idleness(marks[:, 0].astype(np.int64), marks[:, 1], count, end_s, warm_s=warm_s)
        counted = arrivals[arrivals[:, 2] >= warm_s, 1].astype(np.int64)
        return found, int(np.bincount(counted, minlength=count).min())
