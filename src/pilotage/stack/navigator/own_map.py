"""The robot's own map: the walls and discs that it was told of, and what it found on its way."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.arrays import read_only
from pilotage.kernels.geometry import plane
from pilotage.maps.near_walls import NearWalls
from pilotage.maps.world_map import WorldMap
from pilotage.stack.mapping.mapper import Mapper

SHOWN_CELL_M = 0.05


class OwnMap:
    """What the robot was told of, those parts that are near a place at hand, and the discs that it adds.

    Attributes
    ----------
    told
        The map as it was told.
    walls
        Segments that return a beam.
    barriers
        Segments that are not driven into: the walls, and on a grid the edges of what is unknown.
    known_circles_m
        (C, 3) discs that the robot was told of.
    """

    def __init__(self, told: WorldMap, mapper: Mapper | None) -> None:
        self.told = told
        self.walls = NearWalls(told.reflectors.segments_m)
        same = told.barriers is told.reflectors
        self.barriers = self.walls if same else NearWalls(told.barriers.segments_m)
        self.known_circles_m = told.walls.circles_m
        self._mapper = mapper
        # One array as long as nothing is added: what is joined from it need not be joined anew.
        self._none = self._shown = self._mapped = self._found = self.known_circles_m[:0]
        self._circles = self._last_found = self.known_circles_m

    def show(self, points_m: FloatArray) -> None:
        """Put (K, 2) points on the map, in the place of those before: what it almost touched."""
        cells = np.unique(np.rint(points_m / SHOWN_CELL_M), axis=0) * SHOWN_CELL_M
        self._shown = np.column_stack([cells, np.full(len(cells), 0.5 * SHOWN_CELL_M)])
        self._mapped = self._found = self._shown[:0]

    def forgets(self) -> bool:
        """Whether there was anything shown on the map, which is gone now."""
        had = len(self._shown) > 0
        self._shown = self._none
        return had

    @property
    def mapped_circles_m(self) -> FloatArray:
        """(M, 3) what the mapper added."""
        return self._none if self._mapper is None else self._mapper.circles_m

    @property
    def found_circles_m(self) -> FloatArray:
        """(M, 3) what the robot put on the map itself: the mapper's, and what it was shown."""
        mapped = self.mapped_circles_m
        if not len(self._shown):
            return mapped
        if mapped is not self._mapped or not len(self._found):
            self._mapped, self._found = mapped, read_only(np.concatenate([mapped, self._shown]))
        return self._found

    @property
    def circles_m(self) -> FloatArray:
        """(C + M, 3) everything round; joined anew only when the mapper has added to it."""
        found = self.found_circles_m
        if found is not self._last_found:
            self._last_found = found
            self._circles = read_only(np.concatenate([self.known_circles_m, found]))
        return self._circles

    def nearest_room_m(self, pose: Pose2, clearance_m: float) -> FloatArray | None:
        """(2,) the nearest place of the told map that keeps a clearance; None where none does."""
        return self.told.field.nearest_clear(pose.as_array()[:2], clearance_m)

    def distance_m(self, pose: Pose2) -> float:
        """Distance from the pose's point to the nearest thing that is not driven into."""
        return plane.distance_to_nearest(pose.x_m, pose.y_m, self.barriers.segments_m, self.circles_m)
