"""The robot's own map: the walls and discs that it was told of, and what it found on its way."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry import plane
from pilotage.maps.near_walls import NearWalls
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.mapping.mapper import Mapper


class OwnMap:
    """Known segments and discs, with the discs that the mapper adds.

    Attributes
    ----------
    walls, known_circles_m
        Segments, those near a place at hand, and (C, 3) discs that the robot was told of.
    """

    def __init__(self, told: SegmentMap, mapper: Mapper | None) -> None:
        self.walls, self.known_circles_m = NearWalls(told.segments_m), told.circles_m
        self._mapper = mapper
        self._nothing = self.known_circles_m[:0]
        self._circles = self._last_found = self.known_circles_m

    @property
    def found_circles_m(self) -> FloatArray:
        """(M, 3) what the robot put on the map itself."""
        return self._nothing if self._mapper is None else self._mapper.circles_m

    @property
    def circles_m(self) -> FloatArray:
        """(C + M, 3) everything round; joined anew only when the mapper has added to it."""
        found = self.found_circles_m
        if found is not self._last_found:
            self._last_found = found
            self._circles = np.concatenate([self.known_circles_m, found])
        return self._circles

    def distance_m(self, pose: Pose2) -> float:
        """Distance from the pose's point to the nearest thing on the map."""
        return plane.distance_to_nearest(pose.x_m, pose.y_m, self.walls.segments_m, self.circles_m)
