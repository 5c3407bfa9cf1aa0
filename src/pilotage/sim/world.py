"""The world as it is: known walls, landmarks, and the obstacles that nobody told the robot of."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap


@dataclass(frozen=True, slots=True)
class World:
    """Truth about the surroundings.

    Attributes
    ----------
    known
        What is on the robot's map too.
    geometry
        ``known`` plus the unexpected obstacles: what bodies hit and sensors see.
    """

    known: SegmentMap
    geometry: SegmentMap
    landmarks: Landmarks

    @property
    def obstacle_segments_m(self) -> FloatArray:
        """(K, 4) sides of the unexpected obstacles."""
        return self.geometry.segments_m[self.known.segments_m.shape[0] :]

    @property
    def obstacle_circles_m(self) -> FloatArray:
        """(K, 3) unexpected round obstacles."""
        return self.geometry.circles_m[self.known.circles_m.shape[0] :]
