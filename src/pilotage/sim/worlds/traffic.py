"""What moves about: the outlines of robots and people where they are now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.models.footprint import Footprint

NOBODY: IntArray = np.array([0, 0, -1], dtype=np.int64)
"""The rows of an onlooker who is not in the traffic itself."""


@dataclass(frozen=True, slots=True)
class MovingBody:
    """Somebody who walks about and gives way to nobody: a disc.

    Attributes
    ----------
    place
        Time in seconds to x, y.
    """

    name: str
    radius_m: float
    place: Callable[[float], tuple[float, float]]

    @staticmethod
    def along(name: str, radius_m: float, t_s: FloatArray, points_xy_m: FloatArray) -> MovingBody:
        """Follow a recorded track (N,), (N, 2); before and after it stand where it begins and ends.

        Raises
        ------
        InputError
            If times do not rise, or there is no point for each.
        """
        t, points = np.asarray(t_s, dtype=np.float64), np.asarray(points_xy_m, dtype=np.float64)
        if t.ndim != 1 or t.size == 0 or points.shape != (t.size, 2):
            raise InputError(
                f"{name}: expected times (N,) and points (N, 2), found {t.shape} and {points.shape}"
            )
        if not (np.isfinite(t).all() and np.isfinite(points).all() and (np.diff(t) > 0.0).all()):
            raise InputError(f"{name}: expected finite points at rising times, found others")
        x, y = points[:, 0].copy(), points[:, 1].copy()
        return MovingBody(
            name, radius_m, lambda now: (float(np.interp(now, t, x)), float(np.interp(now, t, y)))
        )


class Traffic:
    """Outlines of all moving bodies, robots first; each row is kept up to date by who moves.

    Attributes
    ----------
    segments_m, circles_m
        Sides of the polygons and all discs, where they are now.
    own
        (R, 3) rows of each robot: first side, one past the last, disc or -1.
    """

    def __init__(self, footprints: Sequence[Footprint], people: Sequence[MovingBody]) -> None:
        own, sides = [], 0
        discs: list[tuple[float, float, float]] = []
        for outline in footprints:
            count = len(outline.points_m)
            own.append((sides, sides + count, len(discs) if outline.is_disc else -1))
            sides += count
            if outline.is_disc:
                discs.append((0.0, 0.0, outline.radius_m))
        discs += [(0.0, 0.0, body.radius_m) for body in people]
        self.own: IntArray = np.array(own, dtype=np.int64).reshape(-1, 3)
        self.segments_m: FloatArray = np.zeros((sides, 4))
        self.circles_m: FloatArray = np.array(discs, dtype=np.float64).reshape(-1, 3)
        self._people = tuple(people)
        self._first = len(discs) - len(people)
        self.walk_to(0.0)

    @staticmethod
    def none() -> Traffic:
        """Nobody about."""
        return Traffic((), ())

    def walk_to(self, t_s: float) -> None:
        """Put the people where they are at a time."""
        for row, body in enumerate(self._people, start=self._first):
            self.circles_m[row, 0], self.circles_m[row, 1] = body.place(t_s)
