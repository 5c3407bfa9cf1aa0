"""How well a scan fits the map from a pose: what it explains, and what speaks against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.kernels.lines import pose_hypotheses
from pilotage.kernels.scans.missing import bodies_in_sight
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.lidar import LidarConfig

NO_EYES: FloatArray = np.zeros((0, 2))


@dataclass(frozen=True, slots=True)
class Fit:
    """Shares of a scan's beams, 0 to 1."""

    explained: float
    contradicted: float


class ScanFit:
    """Compares scans with what the map makes one expect.

    Parameters
    ----------
    near_m
        A reading within this of the expected one is explained.
    beyond_m
        A reading longer than expected by more than this passes through a wall of the map.
    eyes_m
        (V, 2) in the scanner's frame, where the lasers are whose scans are joined to it; none of one laser.
    """

    def __init__(
        self,
        world: SegmentMap,
        lidar: LidarConfig,
        max_range_m: float,
        near_m: float,
        beyond_m: float,
        eyes_m: FloatArray = NO_EYES,
    ) -> None:
        first = float(lidar.beam_angles_rad()[0])
        self._mount = lidar.mount
        self._expected = pose_hypotheses.Expected(
            first,
            lidar.beam_step_rad,
            min(max_range_m, lidar.max_range_m),
            near_m,
            beyond_m,
            np.ascontiguousarray(Pose2(0.0, 0.0, first).seen(eyes_m)),
            world.segments_m,
            world.circles_m,
        )

    def sensor_pose(self, pose: FloatArray) -> tuple[float, float, float]:
        """Pose of the scanner for a pose of the robot (3,)."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        mount = self._mount
        return (
            pose[0] + c * mount.x_m - s * mount.y_m,
            pose[1] + s * mount.x_m + c * mount.y_m,
            pose[2] + mount.theta_rad,
        )

    def robot_poses(self, sensor_poses: FloatArray) -> FloatArray:
        """Poses (H, 3) of the robot for poses (H, 3) of its scanner."""
        theta = sensor_poses[:, 2] - self._mount.theta_rad
        c, s = np.cos(theta), np.sin(theta)
        x = sensor_poses[:, 0] - c * self._mount.x_m + s * self._mount.y_m
        y = sensor_poses[:, 1] - s * self._mount.x_m - c * self._mount.y_m
        return np.column_stack([x, y, theta])

    def of(self, pose: FloatArray, ranges_m: FloatArray, extra_m: float = 0.0) -> Fit:
        """Fit of a scan from a pose (3,) of the robot; ``extra_m`` widens both tolerances."""
        x, y, theta = self.sensor_pose(pose)
        explained, contradicted = pose_hypotheses.scan_fit(
            self._expected, x, y, theta + self._expected.first, ranges_m, 1, extra_m
        )
        return Fit(explained, contradicted)

    def mates_in_sight(self, pose: FloatArray, ranges_m: FloatArray, mates: FloatArray) -> IntArray:
        """What a scan from a pose (3,) of the robot says of mates, (K,) as of ``kernels.scans.missing``.

        Parameters
        ----------
        mates
            (K, 4) where each is on the map: x, y of a place, the distance from it within which its middle
            is, and its radius (m); NaN for one that says nothing.
        """
        x, y, theta = self.sensor_pose(pose)
        out = np.empty(len(mates), np.int64)
        first, step, most = self._expected[:3]
        bodies_in_sight(x, y, theta + first, step, ranges_m, most, mates, out)
        return out

    def best(
        self,
        sensor_poses: FloatArray,
        ranges_m: FloatArray,
        stride: int,
        extra_m: float,
        least_explained: float,
        most_contradicted: float,
    ) -> FloatArray:
        """The sensor poses (K, 3) among (H, 3) that fit the scan, best first, from every stride-th beam."""
        kept = pose_hypotheses.fitting_poses(
            self._expected, sensor_poses, ranges_m, stride, extra_m, least_explained, most_contradicted
        )
        return sensor_poses[kept[:, 0].astype(np.int64)]
