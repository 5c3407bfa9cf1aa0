"""Poses taken out of a graph, and what they said of the others kept in few edges."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.models.pose_graph_covariance import covariances, turns
from pilotage.stack.mapping.slam.uncertainty import Edges, relative_poses

NEAR = 8
"""Poses around each that may become its neighbours in the tree."""


def without(edges: Edges, poses: FloatArray, leaving: BoolArray) -> Edges:
    """Return edges between the poses (N, 3) that stay, numbered anew.

    Each connected group of poses that leave is marginalized out: what its edges say of the poses around it
    is kept as the tree of relative poses that say most (Chow and Liu, 1968; for pose graphs Kretzschmar and
    Stachniss, 2012). Each of the tree's edges has the exact covariance by the group, to first order around
    ``poses``; what the group said of other pairs beyond the tree is lost. So the edges grow neither in number
    a pose nor in what they claim to know.
    """
    number = np.cumsum(~leaving) - 1
    touches = leaving[edges.i] | leaving[edges.j]
    out = edges.chosen(~touches)
    out = Edges(number[out.i], number[out.j], out.relative, out.information, out.closes)
    both = leaving[edges.i] & leaving[edges.j]
    size = poses.shape[0]
    links = scipy.sparse.coo_matrix(
        (np.ones(int(both.sum())), (edges.i[both], edges.j[both])), shape=(size, size)
    )
    _, group = scipy.sparse.csgraph.connected_components(links, directed=False)
    of_edge = np.where(leaving[edges.i], group[edges.i], group[edges.j])
    for name in np.unique(of_edge[touches]):
        part = edges.chosen(touches & (of_edge == name))
        tree = _tree(part, poses, leaving)
        if tree is not None:
            i, j, relative, information = tree
            closes = np.zeros(i.size, np.bool_)
            out = out.and_more(Edges(number[i], number[j], relative, information, closes))
    return out


def _tree(
    edges: Edges, poses: FloatArray, leaving: BoolArray
) -> tuple[IntArray, IntArray, FloatArray, FloatArray] | None:
    """Tree over the poses that stay of a group's edges; None where there is but one."""
    members, ends = np.unique(np.concatenate([edges.i, edges.j]), return_inverse=True)
    stays = np.flatnonzero(~leaving[members])
    if stays.size < 2:
        return None
    count = len(edges)
    local = Edges(ends[:count], ends[count:], edges.relative, edges.information, edges.closes)
    fixed = np.zeros(members.size, np.bool_)
    fixed[stays[0]] = True
    known = covariances(local.graph(poses[members]), fixed=fixed)
    _, near = scipy.spatial.cKDTree(poses[members[stays], :2]).query(
        poses[members[stays], :2], min(NEAR, stays.size)
    )
    first = np.repeat(np.arange(stays.size), near.shape[1])
    pairs = np.concatenate(
        [
            np.sort(np.column_stack([first, near.ravel()]), axis=1),
            np.column_stack([np.arange(stays.size - 1), np.arange(1, stays.size)]),
        ]
    )
    pairs = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)
    i, j = stays[pairs[:, 0]], stays[pairs[:, 1]]
    covariance = known.relative(i, j)
    # The weight is what the pair does not know of each other, made positive: a zero would be no edge.
    unsure = np.linalg.slogdet(covariance)[1]
    weight = unsure - unsure.min() + 1.0
    tree = scipy.sparse.csgraph.minimum_spanning_tree(
        scipy.sparse.coo_matrix((weight, (pairs[:, 0], pairs[:, 1])), shape=(stays.size,) * 2)
    )
    row, column = tree.nonzero()
    chosen = np.searchsorted(pairs[:, 0] * stays.size + pairs[:, 1], row * stays.size + column)
    order = np.sort(chosen)
    i, j, covariance = members[i[order]], members[j[order]], covariance[order]
    relative = relative_poses(poses[i], poses[j])
    turn = turns(-relative[:, 2])  # edges hold their errors in the second pose's frame
    information = np.linalg.inv(turn @ covariance @ turn.transpose(0, 2, 1))
    return i, j, relative, 0.5 * (information + information.transpose(0, 2, 1))
