"""The mapper while the robot drives: scan by scan, loops closed as soon as a stretch of path is complete."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.models.pose_graph_covariance import turns
from pilotage.stack.mapping.slam.back_end import LoopCloser, Solved, refined, track_edges, weak_edges
from pilotage.stack.mapping.slam.closures import USUAL_SLIP
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.scan_covariances import SHARED_EDGES
from pilotage.stack.mapping.slam.submaps import TURN_AS_PATH_M
from pilotage.stack.mapping.slam.tracker import LocalTrack, Tracker
from pilotage.stack.mapping.slam.uncertainty import Edges, errors_of

WINDOWS_M = (1.0, 2.0, 4.0)
"""Half a search window's side at most, round by round, each time."""
SCAN_COV = np.diag([0.005**2, 0.005**2, 0.002**2])
"""What a scan's place beside the last keyframe is unsure by."""
USUAL_RMS_M, PRIOR_LOOPS, LEAST_FACTOR = 0.008, 2.0, 1e-4
"""Residuals of scans in an office, how many closed loops they tell as much as, and the least factor."""
LOST_SCANS = 10
"""So many scans in a row that fit nowhere: lost."""


class OnlineSlam:
    """Poses of the scanner in the frame of its first scan, and how sure they are.

    Attributes
    ----------
    keyframe_poses
        (K, 3) by the last optimization.
    accepted
        How many closures count.
    covariance
        (3, 3) of the last keyframe's pose.
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._tracker = Tracker(config)
        self._closer = LoopCloser(config)
        self._misfit, self._loops = 0.0, 0
        self._path_m, self._healed, self._led = 0.0, 0, False
        self.keyframe_poses = np.zeros((0, 3))
        self.covariance = np.zeros((3, 3))
        self._by_scale, self._scale_std = np.zeros(3), 0.0
        self.accepted = 0

    @property
    def pose(self) -> FloatArray:
        """(3,) of the last scan."""
        ahead = between(self._tracker.keyframe_pose, self._tracker.pose)
        return np.asarray(composed(self.keyframe_poses[-1], ahead))

    @property
    def pose_covariance(self) -> FloatArray:
        """(3, 3) of the last scan's pose."""
        here, pose = self.keyframe_poses[-1], self.pose
        by_scale = self._scale_std * lever(here, pose) @ self._by_scale
        own = carried_covariance(self.covariance, here, pose) + np.outer(by_scale, by_scale)
        return own + self._fit() * SCAN_COV

    @property
    def lost(self) -> bool:
        """Whether the last scans fitted nowhere, though something known was to be seen."""
        return self._tracker.lost_run >= LOST_SCANS

    def add(self, cloud: FloatArray, step: FloatArray | None, dt_s: float) -> bool:
        """Take in a scan; True where it became a keyframe, whose poses may all have moved.

        Parameters
        ----------
        cloud
            (K, 6) of ``clouds``.
        step
            (3,) motion of the scanner since the last scan by the odometry; None without.
        dt_s
            Time since the last scan.
        """
        known, self._led = len(self.keyframe_poses), step is not None
        new = self._tracker.add(cloud, step, max(dt_s, 1e-3), dt_s)
        if self._tracker.healed > self._healed:
            self._healed = self._tracker.healed
            self.close()
        if not new:
            return False
        if known == 0:
            self.keyframe_poses = np.zeros((1, 3))
            return True
        self.keyframe_poses = self.keyframe_poses[: self._tracker.keyframes - 1]
        self._extend()
        if self._path_m >= 0.5 * self._config.submap_length_m:
            self._path_m = 0.0
            self.close()
        return True

    def close(self, ended: bool = False) -> int:
        """Look for loops now; how many closed.

        Parameters
        ----------
        ended
            With the stretch of path that is not complete yet.
        """
        closer = self._closer
        closer.grow(self._track(), ended)
        if len(closer.submaps) == 0:
            return 0
        closer.look_again()
        count = sum(closer.close(window_m, USUAL_SLIP)[1] for window_m in WINDOWS_M)
        self.accepted += count
        self._take(closer.state)
        return count

    def refine(self) -> None:
        """Align all keyframes that see the same walls: the last word on the map."""
        track = self._track()
        if len(self.keyframe_poses) < 2:
            return
        self.close(ended=True)
        self._take(refined(self._closer, track.clouds, weak_edges(track)))

    def _track(self) -> LocalTrack:
        return self._with_odometry(self._tracker.track())

    def _with_odometry(self, track: LocalTrack) -> LocalTrack:
        """The track, or the end of it, with what the odometry tells beside the alignments.

        For recordings they have to do alone, as stamps lie; on a robot odometry and scans belong together.
        """
        if not (self._led and self._config.use_odometry) or len(track.keyframes) < 2:
            return track
        odometry = self._tracker.by_odometry(len(track.keyframes))
        self._scale_std = odometry.scale_std
        return replace(track, odometry=odometry)

    def _take(self, state: Solved) -> None:
        """Put the keyframes where the graph has them; note what its edges are off by, a loop's in all."""
        off = errors_of(state.edges, state.poses)
        squares = np.einsum("mi,mij,mj->m", off, state.edges.information, off)
        self._misfit = float((state.weights * squares).sum()) / 3.0
        self._loops = int(state.edges.closes.sum())
        self.keyframe_poses = state.poses.copy()
        known = state.covariances(self._variance_factor())
        self.covariance = known.marginals(np.array([len(state.poses) - 1]))[0]
        self._by_scale = known.moved_by(_lengths(state.edges), state.edges.by_odometry)[-1]

    def _fit(self) -> float:
        """Squares of the scans' residuals over those in an office of many things, 1 at most."""
        return min((self._tracker.rms_m / USUAL_RMS_M) ** 2, 1.0)

    def _variance_factor(self) -> float:
        """What the variances of alignments are multiplied by.

        They are those of scans with residuals as in an office; a scanner whose scans fit better is the surer
        for it, and what the closed loops were off by says more the more they are: the estimated variance
        factor of adjustment (Koch 1999, sect. 3.2.4), the residuals of the scans being its prior. Of what an
        odometry tells neither of them says anything: along a corridor loops are off by nothing.
        """
        factor = (PRIOR_LOOPS * self._fit() + self._misfit) / (PRIOR_LOOPS + self._loops)
        return SHARED_EDGES * max(factor, LEAST_FACTOR)

    def _extend(self) -> None:
        """Hang the new keyframe on the one before."""
        edge = track_edges(self._with_odometry(self._tracker.last_step()))
        moved = edge.relative[0]
        here = self.keyframe_poses[-1]
        pose = composed(here, moved)
        self._path_m += float(np.hypot(moved[0], moved[1])) + TURN_AS_PATH_M * abs(float(moved[2]))
        own = np.linalg.inv(edge.calibrated(self._variance_factor()).information[0])
        turn = turns(pose[2])
        longer = own @ edge.by_odometry[0] @ _lengths(edge)[0]
        self._by_scale = lever(here, pose) @ self._by_scale + turn @ longer
        self.covariance = carried_covariance(self.covariance, here, pose) + turn @ own @ turn.T
        self.keyframe_poses = np.concatenate([self.keyframe_poses, pose[None]])


def lever(pose: FloatArray, to: FloatArray) -> FloatArray:
    """(3, 3) by how much a pose in the map moves with another on which it hangs rigidly."""
    out = np.eye(3)
    out[0, 2], out[1, 2] = -(to[1] - pose[1]), to[0] - pose[0]
    return out


def carried_covariance(covariance: FloatArray, pose: FloatArray, to: FloatArray) -> FloatArray:
    """Covariance (3, 3) of a pose in the map, seen at another that hangs on it rigidly."""
    carry = lever(pose, to)
    return np.asarray(carry @ covariance @ carry.T)


def _lengths(edges: Edges) -> FloatArray:
    """(M, 3) by how much longer edges are for a share of their lengths, in the frame of the second pose."""
    along = edges.relative * [1.0, 1.0, 0.0]
    return np.asarray(np.einsum("mij,mj->mi", turns(-edges.relative[:, 2]), along))
