"""What a laser shows that the walls a robot was told of do not explain, worked out once for whoever asks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.lines.clustering import beam_directions
from pilotage.kernels.scans.unexpected import unexplained_points
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.stack.interface import Belief


@dataclass(frozen=True, slots=True, eq=False)
class Unexplained:
    """Of one scan.

    Attributes
    ----------
    x_m, y_m, first_rad
        Where the laser was and its first beam looked to, in the map.
    spread_m, spread_rad
        By so much place and heading may be off.
    points_m, beams
        (K, 2) returns that no wall explains, in the map, in the order of the beams; which (K,) they are.
    """

    x_m: float
    y_m: float
    first_rad: float
    spread_m: float
    spread_rad: float
    points_m: FloatArray
    beams: IntArray


class UnexplainedReturns:
    """Returns nearer than ``reach_m`` that end farther from every wall of the chart than the tolerance.

    The tolerance grows by ``sigmas`` standard deviations of the pose. Mapper and tracker ask for the same
    scan in the same step: the last answer is kept.
    """

    def __init__(self, lidar: LidarConfig, chart: WorldMap, tolerance_m: float, sigmas: float) -> None:
        self._mount, self._known = lidar.mount, chart.wall_field
        self._most_m, self.reach_m = lidar.max_range_m, 0.0
        self.tolerance_m, self.sigmas = tolerance_m, sigmas
        angles = lidar.beam_angles_rad()
        self._first_rad = float(angles[0])
        self._directions = beam_directions(0.0, lidar.beam_step_rad, lidar.beams)
        self._asked: tuple[FloatArray | None, Belief | None] = None, None
        self._last: Unexplained | None = None

    def look_to(self, reach_m: float) -> None:
        """Somebody wants to know of returns so far away, or farther than the lidar's reach of all."""
        self.reach_m = max(self.reach_m, min(reach_m, self._most_m))

    def of(self, scan: LidarScan, belief: Belief) -> Unexplained:
        """Those of a scan, as the robot believes to stand."""
        if self._last is not None and self._asked[0] is scan.ranges_m and self._asked[1] is belief:
            return self._last
        pose, cov, mount, known = belief.pose, belief.cov, self._mount, self._known
        at = pose.compose(mount.pose)
        first = pose.theta_rad + mount.theta_rad + self._first_rad
        spread_m = self.sigmas * math.sqrt(max(cov[0, 0], cov[1, 1]))
        spread_rad = self.sigmas * math.sqrt(cov[2, 2])
        points, beams = unexplained_points(
            scan.ranges_m,
            at.x_m,
            at.y_m,
            first,
            self._directions,
            self.reach_m,
            self.tolerance_m + spread_m,
            spread_rad,
            known.nodes_m,
        )
        self._asked = scan.ranges_m, belief
        self._last = Unexplained(at.x_m, at.y_m, first, spread_m, spread_rad, points, beams)
        return self._last
