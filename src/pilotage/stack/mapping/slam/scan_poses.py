"""Poses of all scans from those of the keyframes: hung between them, then aligned with what they saw."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.buckets import sort_into_buckets
from pilotage.kernels.slam.frames import between, composed, gathered
from pilotage.kernels.slam.pairs import LAST_REACH_M, SCALE_M
from pilotage.kernels.slam.slips import told_by
from pilotage.logs.laser_log import LaserLog
from pilotage.models.pose_graph_covariance import turns
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import LocalTrack
from pilotage.stack.mapping.slam.uncertainty import TRACK_STD_M, relative_poses

AROUND = 4
"""Keyframes to either side along the path that lend a scan their points."""
BUCKET_M, REACH_M = 0.15, 0.5
MOST_MOVED_M, MOST_MOVED_RAD = 1.0, 0.3
PRIOR = read_only(np.diag([0.1, 0.1, 1.0]))
"""Holds a scan that is being aligned where nothing else does, in squared residuals."""
HUNG_COV = np.diag([0.02, 0.02, 0.008]) ** 2
"""Of where a scan hangs between the keyframes, beside what may have slipped between these."""
DOUBTED_SQUARE = 3.0
"""Squared distance of the aligned pose from where the scan hung, in covariances: that counts half then."""


def scan_poses(track: LocalTrack, keyframe_poses: FloatArray) -> FloatArray:
    """(N, 3) poses of all scans: the front end's motions hung between the keyframes around each.

    What the keyframes ahead were moved by is handed out along the way to them, by the share of the path.
    """
    count = track.poses.shape[0]
    out = np.empty((count, 3))
    shares = _shares(track)
    last = track.keyframes.size - 1
    for i in range(count):
        k = int(track.owner[i])
        here = composed(keyframe_poses[k], between(track.poses[track.keyframes[k]], track.poses[i]))
        if k < last:
            b = int(track.keyframes[k + 1])
            there = composed(keyframe_poses[k + 1], between(track.poses[b], track.poses[i]))
            turn = (there[2] - here[2] + np.pi) % (2.0 * np.pi) - np.pi
            here = np.array(
                [
                    here[0] + shares[i] * (there[0] - here[0]),
                    here[1] + shares[i] * (there[1] - here[1]),
                    (here[2] + shares[i] * turn + np.pi) % (2.0 * np.pi) - np.pi,
                ]
            )
        out[i] = here
    return out


def _shares(track: LocalTrack) -> FloatArray:
    """(N,) of the path from the keyframe before each scan to the one after it; 0 behind the last one."""
    moved = relative_poses(track.poses[:-1], track.poses[1:])
    path = np.concatenate([[0.0], np.cumsum(np.hypot(moved[:, 0], moved[:, 1]) + 0.3 * np.abs(moved[:, 2]))])
    at = path[track.keyframes]
    whole = np.append(np.maximum(np.diff(at), 1e-9), np.inf)
    return np.asarray((path - at[track.owner]) / whole[track.owner])


def _slipped(track: LocalTrack, poses: FloatArray) -> FloatArray:
    """(N, 3, 3) in the map of what the front end may have slipped at scans that hang at poses (N, 3).

    It is nothing at the keyframes before and behind, and in between that of a Brownian bridge.
    """
    share = np.clip(_shares(track), 0.0, 1.0)
    ahead = np.minimum(track.owner + 1, track.keyframes.size - 1)
    slipped = (share * (1.0 - share))[:, None, None] * track.slips[ahead]
    turn = turns(poses[:, 2])
    return np.asarray(turn @ slipped @ turn.transpose(0, 2, 1))


def aligned_scans(
    log: LaserLog,
    track: LocalTrack,
    clouds: Clouds,
    keyframe_poses: FloatArray,
    start: FloatArray,
    config: SlamConfig,
    spacing: float,
) -> tuple[FloatArray, FloatArray]:
    """Poses (N, 3) of all scans, those between the keyframes aligned with the keyframes around them.

    The front end had to place a scan by what was before it, from a motion that a stamp may have told wrongly.
    Here what comes after it counts as well. One that fits nowhere near its start stays there.

    Parameters
    ----------
    clouds, keyframe_poses
        Points of the keyframes and (K, 3) their poses.
    start
        (N, 3) of ``scan_poses``.
    spacing
        As in ``cloud_of``.

    Returns
    -------
    The poses, and (N, 3, 3) in the map what is left there of slips between the keyframes.
    """
    out = start.copy()
    slipped = _slipped(track, start)
    between_keyframes = np.ones(len(log), np.bool_)
    between_keyframes[track.keyframes] = False
    waiting = np.flatnonzero(between_keyframes)
    waiting = waiting[np.argsort(track.owner[waiting], kind="stable")]
    have = -1
    fitting, offs, infos = [], [], []
    for i in waiting.tolist():
        owner = int(track.owner[i])
        if owner != have:
            around = np.arange(max(0, owner - AROUND), min(len(clouds), owner + AROUND + 2))
            points = gathered(clouds.points, clouds.starts, around, keyframe_poses, np.zeros(3))
            box, starts, _, ordered = sort_into_buckets(points, BUCKET_M)
            have = owner
        cloud = cloud_of(log, i, config.max_range_m, spacing)
        pose, hessian, fit, status = align(
            cloud, start[i], PRIOR, REACH_M, LAST_REACH_M, SCALE_M, 30, box, starts, ordered
        )
        off = pose - start[i]
        off[2] = (off[2] + np.pi) % (2.0 * np.pi) - np.pi
        if status != TOO_FEW and np.hypot(off[0], off[1]) < MOST_MOVED_M and abs(off[2]) < MOST_MOVED_RAD:
            fitting.append(i)
            offs.append(off)
            infos.append(told_by(hessian, float(fit[1])) / TRACK_STD_M**2)
    if fitting:
        steps, slipped[fitting] = _believed(np.array(offs), np.array(infos), slipped[fitting])
        moved = out[fitting] + steps
        moved[:, 2] = (moved[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        out[fitting] = moved
    return out, slipped


def _believed(offs: FloatArray, told: FloatArray, slipped: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far (M, 3) scans move that alignments would move by ``offs``, and what is left (M, 3, 3) of slips.

    Alignment and place count by what they know: ``told`` (M, 3, 3) is the alignments' information.
    """
    hung, off = HUNG_COV + slipped, offs[:, :, None]
    # By the matrix inversion lemma: the inverse of what tells nothing along a corridor is not needed.
    gain = np.linalg.solve(np.eye(3) + told @ hung, told)
    kept = 1.0 / (1.0 + off.transpose(0, 2, 1) @ gain @ off / DOUBTED_SQUARE)
    turned = (np.eye(3) + told @ slipped / kept).transpose(0, 2, 1)
    left = np.linalg.solve(turned, slipped / kept)
    moved = np.linalg.solve(told + kept * np.linalg.inv(hung), told @ off)
    return np.asarray(moved[:, :, 0]), np.asarray(0.5 * (left + left.transpose(0, 2, 1)))
