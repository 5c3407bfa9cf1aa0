"""Edges from alignments, and how sure chosen poses are together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.models.pose_graph import PoseGraph
from pilotage.stack.mapping.slam.chains import BlockSystem, without_chains

TRACK_STD_M = 0.03
"""What the residual of a point counts as that is aligned with keyframes along the path."""
LEAST_INFORMATION = np.diag([1.0, 1.0, 1.0])
"""One metre, one radian: where an alignment tells nothing, the solver has a system all the same."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Relative measurements as in ``PoseGraph``, and which of them close a loop."""

    i: IntArray
    j: IntArray
    relative: FloatArray
    information: FloatArray
    closes: BoolArray

    def __len__(self) -> int:
        return int(self.i.size)

    def and_more(self, other: Edges) -> Edges:
        """Return both one after the other."""
        return Edges(
            np.concatenate([self.i, other.i]),
            np.concatenate([self.j, other.j]),
            np.concatenate([self.relative, other.relative]),
            np.concatenate([self.information, other.information]),
            np.concatenate([self.closes, other.closes]),
        )

    def scaled(self, factor: float) -> Edges:
        """Return them with all information multiplied."""
        return replace(self, information=self.information * factor)

    def chosen(self, which: BoolArray) -> Edges:
        """Return some of them."""
        return Edges(
            self.i[which],
            self.j[which],
            self.relative[which],
            self.information[which],
            self.closes[which],
        )

    def graph(self, poses: FloatArray) -> PoseGraph:
        """Return the graph of these edges at some poses."""
        return PoseGraph(poses, self.i, self.j, self.relative, self.information)


NO_EDGES = Edges(
    np.zeros(0, np.int64),
    np.zeros(0, np.int64),
    np.zeros((0, 3)),
    np.zeros((0, 3, 3)),
    np.zeros(0, np.bool_),
)


def edge_information(
    hessian: FloatArray,
    theta_rad: FloatArray,
    std_m: float,
    floor: FloatArray | None = None,
    least: FloatArray = LEAST_INFORMATION,
) -> FloatArray:
    """Information (M, 3, 3) of relative poses in the frame of the second one.

    Parameters
    ----------
    hessian
        (M, 3, 3) of the alignments in the first one's frame.
    theta_rad
        (M,) headings of the second as seen from the first.
    std_m
        What a point's residual counts as. Neighbouring points err together, so it is more than their scatter.
    floor
        (M, 3, 3) or (3, 3) covariance that is there in any case.
    least
        (3, 3) information that is there in any case.
    """
    c, s = np.cos(theta_rad), np.sin(theta_rad)
    turn = np.zeros((theta_rad.size, 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = c
    turn[:, 0, 1], turn[:, 1, 0] = -s, s
    turn[:, 2, 2] = 1.0
    out: FloatArray = turn.transpose(0, 2, 1) @ hessian @ turn / std_m**2 + least
    if floor is not None:
        out = np.asarray(np.linalg.inv(np.linalg.inv(out) + floor), np.float64)
    return np.asarray(0.5 * (out + out.transpose(0, 2, 1)))


def relative_poses(first: FloatArray, second: FloatArray) -> FloatArray:
    """(M, 3) of the second poses (M, 3) seen from the first."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    d = second - first
    turn = (d[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return np.stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1], turn], axis=1)


def jacobians(first: FloatArray, second: FloatArray, theta_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Jacobians (M, 3, 3) of relative poses, turned into frames at ``theta_rad``, by the two poses."""
    a = first[:, 2] + theta_rad
    c, s = np.cos(a), np.sin(a)
    d = second - first
    by_second = np.zeros((first.shape[0], 3, 3))
    by_second[:, 0, 0] = by_second[:, 1, 1] = c
    by_second[:, 0, 1], by_second[:, 1, 0] = s, -s
    by_second[:, 2, 2] = 1.0
    by_first = -by_second
    by_first[:, 0, 2] = -s * d[:, 0] + c * d[:, 1]
    by_first[:, 1, 2] = -c * d[:, 0] - s * d[:, 1]
    return by_first, by_second


def errors_of(edges: Edges, poses: FloatArray) -> FloatArray:
    """(M, 3) predicted minus measured, in the frame of each measurement."""
    predicted = relative_poses(poses[edges.i], poses[edges.j])
    return relative_poses(edges.relative, predicted)


@dataclass(frozen=True, slots=True)
class JointCovariance:
    """Joint covariance of C poses, every pair of them once: it is the largest thing in memory.

    Attributes
    ----------
    pairs
        (C (C + 1) / 2, 3, 3) the block of rows of pose a and columns of b, b <= a, at a (a + 1) / 2 + b.
    """

    pairs: FloatArray

    def blocks(self, a: IntArray, b: IntArray) -> FloatArray:
        """(M, 3, 3) rows of poses ``a`` (M,) and columns of ``b`` (M,)."""
        last = np.maximum(a, b)
        out = self.pairs[last * (last + 1) // 2 + np.minimum(a, b)]
        return np.asarray(np.where((a < b)[:, None, None], out.transpose(0, 2, 1), out))

    def among(self, chosen: IntArray) -> FloatArray:
        """(3 K, 3 K) of some of the poses (K,)."""
        count = chosen.size
        out = self.blocks(np.repeat(chosen, count), np.tile(chosen, count)).reshape(count, count, 3, 3)
        return np.asarray(out.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count))


def joint_covariance(
    edges: Edges, poses: FloatArray, weights: FloatArray, chosen: IntArray
) -> JointCovariance:
    """Joint covariance of chosen poses (C,) in the map, the first pose being held."""
    first, second = jacobians(poses[edges.i], poses[edges.j], edges.relative[:, 2])
    information = edges.information * weights[:, None, None]
    left, right = first.transpose(0, 2, 1) @ information, second.transpose(0, 2, 1) @ information
    diagonal = np.zeros((poses.shape[0], 3, 3))
    np.add.at(diagonal, edges.i, left @ first)
    np.add.at(diagonal, edges.j, right @ second)
    diagonal[0] += 1e9 * np.eye(3)
    kept = np.zeros(poses.shape[0], np.bool_)
    kept[chosen] = True
    whole = BlockSystem.merged(diagonal, edges.i, edges.j, left @ second)
    system, stays = without_chains(whole, kept)
    factor = splu(
        _as_matrix(system), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    count = chosen.size
    places = (3 * np.searchsorted(stays, chosen)[:, None] + np.arange(3)).ravel()
    out = np.empty((count * (count + 1) // 2, 3, 3))
    # A few columns at a time: all of them would be as large as the graph is long times the submaps.
    for start in range(0, count, 32):
        block = places[3 * start : 3 * start + 96]
        unit = np.zeros((3 * stays.size, block.size))
        unit[block, np.arange(block.size)] = 1.0
        columns = factor.solve(unit)[places].reshape(count, 3, -1, 3)
        for b in range(start, min(start + 32, count)):
            a = np.arange(b, count)
            out[a * (a + 1) // 2 + b] = columns[b:, :, b - start]
    return JointCovariance(out)


def _as_matrix(system: BlockSystem) -> csc_matrix:
    """(3 N, 3 N) of a block system."""
    count = system.diagonal.shape[0]
    k = np.arange(count)
    blocks = np.concatenate([system.diagonal, system.blocks, system.blocks.transpose(0, 2, 1)])
    rows = 3 * np.concatenate([k, system.i, system.j])[:, None, None] + np.arange(3)[None, :, None]
    columns = 3 * np.concatenate([k, system.j, system.i])[:, None, None] + np.arange(3)[None, None, :]
    at = (np.broadcast_to(rows, blocks.shape).ravel(), np.broadcast_to(columns, blocks.shape).ravel())
    return csc_matrix((blocks.ravel(), at), shape=(3 * count, 3 * count))
