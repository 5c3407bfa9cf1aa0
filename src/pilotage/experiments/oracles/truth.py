"""What the oracles know of one robot and its world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.sim.bodies.body import Body


@dataclass(eq=False)
class Truth:
    """The world as it is; the body comes into being after the stack.

    Attributes
    ----------
    chart
        The world's map as it was drawn.
    obstacle_segments_m, obstacle_circles_m
        (K, 4) and (L, 3) what is not on it.
    body
        The robot's, once there is one.
    """

    chart: WorldMap
    obstacle_segments_m: FloatArray
    obstacle_circles_m: FloatArray
    start: Pose2
    body: Body | None = None

    @property
    def pose(self) -> Pose2:
        """Where the robot is."""
        return self.start if self.body is None else self.body.pose

    def tell_pose(self) -> Pose2:
        """The same as a call, for who is given it."""
        return self.pose

    @cached_property
    def geometry(self) -> SegmentMap:
        """Walls and obstacles."""
        return self.chart.walls.with_obstacles(self.obstacle_segments_m, self.obstacle_circles_m)

    @cached_property
    def field(self) -> DistanceField:
        """Distance to the nearest of them."""
        return DistanceField.from_map(self.geometry)
