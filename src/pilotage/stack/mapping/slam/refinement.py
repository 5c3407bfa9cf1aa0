"""The last word: all keyframes that see the same walls aligned with one another, then the graph again."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.align import TOO_FEW
from pilotage.kernels.slam.pairs import align_pairs
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.uncertainty import Edges, edge_information, relative_poses

RADIUS_M = 2.5
MOST_TURN_RAD = 1.6
TURN_AS_DISTANCE_M = 0.6
NEIGHBOURS = 8
APART = 6
"""Keyframes between two neighbours of the same one: as many different passes as possible."""
ALONG = (1, 2, 4)
"""Keyframes ahead that each one is aligned with along the path."""
LEAST_BEHIND = 12
SPREAD = 2
PRIOR = np.diag([0.5, 0.5, 5.0])
REACH_M, LAST_REACH_M, SCALE_M = 0.3, 0.12, 0.03
LEAST_PAIRED = 0.4
MOST_MOVED_M, MOST_MOVED_RAD = 0.35, 0.12
PAIR_STD_M = 0.05
BESIDE = 8
"""A closure is told again by an alignment of keyframes at most so far along the path from both its ends."""


def neighbours(poses: FloatArray, since: int = 0) -> IntArray:
    """Pairs (M, 2), earlier keyframe first and sorted by it, of keyframes (K, 3) that may see the same.

    With ``since`` they are pairs of one before it with one from it on alone.
    """
    count = poses.shape[0]
    tree = scipy.spatial.cKDTree(poses[:, :2])
    first = [np.arange(count - ahead) for ahead in ALONG if ahead < count and not since]
    second = [np.arange(ahead, count) for ahead in ALONG if ahead < count and not since]
    for i in range(since, count):
        near = np.array(tree.query_ball_point(poses[i, :2], RADIUS_M, return_sorted=True), np.int64)
        near = near[near < (since or i - LEAST_BEHIND)]
        turn = np.abs((poses[near, 2] - poses[i, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        near, turn = near[turn < MOST_TURN_RAD], turn[turn < MOST_TURN_RAD]
        if near.size == 0:
            continue
        cost = np.hypot(*(poses[near, :2] - poses[i, :2]).T) + TURN_AS_DISTANCE_M * turn
        chosen: list[int] = []
        for k in near[np.argsort(cost, kind="stable")].tolist():
            if all(abs(k - other) > APART for other in chosen):
                chosen.append(k)
                if len(chosen) == NEIGHBOURS:
                    break
        first.append(np.array(chosen, np.int64))
        second.append(np.full(len(chosen), i))
    if not first:
        return np.zeros((0, 2), np.int64)
    pairs = np.column_stack([np.concatenate(first), np.concatenate(second)])
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def pair_edges(clouds: Clouds, poses: FloatArray, pairs: IntArray) -> Edges:
    """Align pairs (M, 2) of keyframes from where the poses have them; those that do not fit are left out."""
    relative, hessian, fit, status = align_pairs(
        clouds.points,
        clouds.starts,
        poses,
        pairs,
        SPREAD,
        REACH_M,
        LAST_REACH_M,
        SCALE_M,
        PRIOR,
    )
    relative[:, 2] = (relative[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    moved = relative_poses(relative_poses(poses[pairs[:, 0]], poses[pairs[:, 1]]), relative)
    sound = (
        (status != TOO_FEW)
        & (fit[:, 3] > LEAST_PAIRED)
        & (np.hypot(moved[:, 0], moved[:, 1]) < MOST_MOVED_M)
        & (np.abs(moved[:, 2]) < MOST_MOVED_RAD)
    )
    return Edges(
        pairs[sound, 0],
        pairs[sound, 1],
        relative[sound],
        edge_information(hessian[sound], relative[sound, 2], PAIR_STD_M),
        pairs[sound, 1] - pairs[sound, 0] > max(ALONG),
    )


def not_aligned(closing: Edges, aligned: Edges) -> Edges:
    """Return the closures between stretches of which no two keyframes are aligned with each other."""
    ends = np.column_stack([closing.i, closing.j])
    across = aligned.closes
    if len(closing) == 0 or not across.any():
        return closing
    tree = scipy.spatial.cKDTree(np.column_stack([aligned.i[across], aligned.j[across]]))
    far = np.asarray(tree.query(ends, p=np.inf)[0], np.float64)
    return closing.chosen(far > BESIDE)
