"""How sure the poses of scans are, alone and seen from one another.

What the graph says holds given that its edges err independently; they do not, as each scan is in many of
them, so its covariances are doubled. Every scan has an error of its own: stamps that are some milliseconds
off, a body that moves while the mirror turns, walls that are no lines. It is the larger the worse scans fit
to their surroundings. And the place of the scanner on the robot is known to a few centimetres only: an error
that all scans share, and that shows between poses as far as they are turned against each other. Whose frame
somebody's reference speaks of is as unsure as the frames are apart that the recording tells. The numbers
serve the Intel and the Freiburg 079 recordings together; see docs/decisions/0038, 0212, 0216 and 0321.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.models.pose_graph import PoseGraph
from pilotage.models.pose_graph_covariance import PoseCovariances, covariances, turns

SHARED_EDGES = 2.0
SCAN_STD_A_RESIDUAL = np.array([0.9, 0.9, 0.31])
LEAST_RESIDUAL_M = 0.004
"""A scan's own error [m, m, rad] over its points' usual residuals, which are this at least."""
MOUNT_STD_M = 0.03
UNKNOWN_RAD2 = np.pi**2 / 3.0
"""Variance of a heading of which nothing is known."""


@dataclass(frozen=True, slots=True)
class ScanCovariances:
    """Covariances of scans' poses.

    Attributes
    ----------
    graph, weights
        Of keyframes, and how much each edge counts.
    owner
        (N,) keyframe of each scan.
    poses
        (N, 3) of the scans in the map.
    own
        (N, 3, 3) in the map of what may be left, beside its keyframes, of a slip of the front end.
    mount_m
        How far the scanner is told to be from the robot's frame.
    residual_m
        Root mean square of the residuals by which a scan fits, as a rule.
    """

    graph: PoseGraph
    weights: FloatArray
    owner: IntArray
    poses: FloatArray
    own: FloatArray
    mount_m: float
    residual_m: float

    def marginals(self) -> FloatArray:
        """Return (N, 3, 3) in the map, the first keyframe being held."""
        graph = self._of_graph().marginals() if len(self.graph) > 1 else np.zeros((1, 3, 3))
        keyframes = self.graph.poses[self.owner]
        carry = np.tile(np.eye(3), (self.owner.size, 1, 1))
        carry[:, 0, 2] = -(self.poses[:, 1] - keyframes[:, 1])
        carry[:, 1, 2] = self.poses[:, 0] - keyframes[:, 0]
        shared = carry @ (SHARED_EDGES * graph[self.owner]) @ carry.transpose(0, 2, 1)
        own = self.own + self._of_scan()
        return _at_most_unknown(shared + own + self._of_mount(self.poses[:, 2] - self.poses[0, 2]))

    def relative(self, i: IntArray, j: IntArray) -> FloatArray:
        """Return (K, 3, 3) of x, y, theta of scan j as seen from scan i."""
        first, second = self.owner[i], self.owner[j]
        between = np.zeros((first.size, 3, 3))
        apart = first != second
        if apart.any():
            between[apart] = SHARED_EDGES * self._of_graph().relative(first[apart], second[apart])
        rotation = turns(self.graph.poses[first, 2] - self.poses[i, 2])
        c, s = np.cos(self.poses[i, 2]), np.sin(self.poses[i, 2])
        into = turns(-self.poses[i, 2])
        own = into @ (self.own[[i, j]] + self._of_scan()) @ into.transpose(0, 2, 1)
        d = self.poses[j] - self.poses[i]
        lever = np.tile(np.eye(3), (first.size, 1, 1))
        lever[:, 0, 2] = -s * d[:, 0] + c * d[:, 1]
        lever[:, 1, 2] = -c * d[:, 0] - s * d[:, 1]
        out = rotation @ between @ rotation.transpose(0, 2, 1) + own[1]
        out += lever @ own[0] @ lever.transpose(0, 2, 1)
        out += self._of_mount(self.poses[j, 2] - self.poses[i, 2])
        return _at_most_unknown(0.5 * (out + out.transpose(0, 2, 1)))

    def _of_scan(self) -> FloatArray:
        """(3, 3) of a scan's own error, the same in all directions."""
        std = max(self.residual_m, LEAST_RESIDUAL_M) * SCAN_STD_A_RESIDUAL
        return np.asarray(np.diag(std**2))

    def _of_graph(self) -> PoseCovariances:
        return covariances(self.graph, weights=self.weights)

    def _of_mount(self, turn_rad: FloatArray) -> FloatArray:
        """(K, 3, 3) between poses turned against each other by (K,): a mount m off moves one by (R - I) m."""
        out = np.zeros((turn_rad.size, 3, 3))
        variance = MOUNT_STD_M**2 + self.mount_m**2
        out[:, 0, 0] = out[:, 1, 1] = 2.0 * (1.0 - np.cos(turn_rad)) * variance
        return out


def _at_most_unknown(covariance: FloatArray) -> FloatArray:
    """Scale covariances (K, 3, 3) whose heading is less known than unknown, and what hangs on it alike.

    After a break that nothing joins, linear errors add up to whole turns, and to kilometres at their ends.
    """
    share = np.minimum(1.0, UNKNOWN_RAD2 / covariance[:, 2, 2])
    return np.asarray(share[:, None, None] * covariance)
