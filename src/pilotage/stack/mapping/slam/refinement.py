"""The last word: all keyframes that see the same walls aligned with one another, then the graph again."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.align import TOO_FEW
from pilotage.kernels.slam.pairs import align_pairs
from pilotage.kernels.slam.seen_again import passes_near
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.uncertainty import Edges, edge_information, relative_poses

ALONG = (1, 2, 4)
"""Keyframes ahead that each one is aligned with along the path."""
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
    again = passes_near(poses, since)
    along = [np.arange(count - ahead)[:, None] + [0, ahead] for ahead in ALONG if ahead < count and not since]
    pairs = np.concatenate([*along, again])
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def pair_edges(clouds: Clouds, poses: FloatArray, pairs: IntArray) -> Edges:
    """Align pairs (M, 2) of keyframes from where the poses have them; those that do not fit are left out."""
    relative, hessian, fit, status = align_pairs(clouds.points, clouds.starts, poses, pairs)
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
