"""What moves about: the outlines of robots and people where they are now."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.geometry.solids import Others
from pilotage.models.footprint import Footprint

NOBODY: IntArray = np.array([0, 0, -1], dtype=np.int64)
"""The rows of an onlooker who is not in the traffic itself."""

NO_RADII: FloatArray = np.zeros(0)
NOWHERE_M = 1e7
"""Where the kernels find those who are not there: beyond everything."""


class Traffic:
    """Outlines of all moving bodies, robots first; each row is kept up to date by who moves.

    Attributes
    ----------
    segments_m, circles_m, others
        Sides of the polygons and all discs, where they are now; ``others`` holds both, as kernels take them.
    own
        (R, 3) rows of each robot: first side, one past the last, disc or -1.
    first_person
        Row of the first person's disc: those after it are people, too.
    """

    def __init__(self, footprints: Sequence[Footprint], people_radius_m: FloatArray = NO_RADII) -> None:
        own, sides = [], 0
        discs: list[tuple[float, float, float]] = []
        for outline in footprints:
            count = len(outline.points_m)
            own.append((sides, sides + count, len(discs) if outline.is_disc else -1))
            sides += count
            if outline.is_disc:
                discs.append((0.0, 0.0, outline.radius_m))
        self.first_person = len(discs)
        discs += [(NOWHERE_M, NOWHERE_M, radius) for radius in people_radius_m.tolist()]
        self.own: IntArray = np.array(own, dtype=np.int64).reshape(-1, 3)
        self.segments_m: FloatArray = np.zeros((sides, 4))
        self.circles_m: FloatArray = np.array(discs, dtype=np.float64).reshape(-1, 3)
        self.others: Others = (self.segments_m, self.circles_m)

    @staticmethod
    def none() -> Traffic:
        """Nobody about."""
        return Traffic(())

    @property
    def is_anybody(self) -> bool:
        """Whether anybody can be met; who is alone in the world is in no traffic."""
        return len(self.segments_m) + len(self.circles_m) > 0

    def put_people(self, places_m: FloatArray) -> None:
        """Put the people where they are now (P, 2); NaN: not there."""
        rows = self.circles_m[self.first_person :]
        rows[:, :2] = np.where(np.isnan(places_m), NOWHERE_M, places_m)
