"""How sure the poses of an optimized pose graph are, and how sure one is as seen from another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.slam.block_cholesky import factorize, solve_lower, solve_upper
from pilotage.kernels.slam.covariances import column_products, inverse_blocks, inverse_columns, joint_products
from pilotage.kernels.slam.edges import SQUARE, Doubts, Pattern, normal_equations
from pilotage.models.pose_graph import PoseGraph
from pilotage.models.pose_graph_solver import check_fixed, eliminate


@dataclass(frozen=True, slots=True)
class JointCovariance:
    """Joint covariance of some poses of a graph, whose blocks are worked out when they are asked for.

    Attributes
    ----------
    poses
        (C, 3).
    starts, path, columns
        What their covariances are products of (``kernels.slam.covariances.inverse_columns``).
    """

    poses: FloatArray
    starts: IntArray
    path: IntArray
    columns: FloatArray

    def blocks(self, a: IntArray, b: IntArray) -> FloatArray:
        """(M, 3, 3) rows of poses ``a`` (M,) and columns of ``b`` (M,), by their numbers among these."""
        return column_products(self.starts, self.path, self.columns, a, b)

    def among(self, chosen: IntArray) -> FloatArray:
        """(3 K, 3 K) of some of the poses (K,)."""
        return joint_products(self.starts, self.path, self.columns, chosen)

    def relative(self, i: IntArray, j: IntArray) -> FloatArray:
        """(M, 3, 3) of x, y, theta of pose j as seen from pose i."""
        k = np.arange(self.poses.shape[0])
        own = self.blocks(k, k)
        return _seen(self.poses[i], self.poses[j], own[i], own[j], self.blocks(i, j))


@dataclass(frozen=True, slots=True)
class PoseCovariances:
    """Covariances of the poses of a graph, from the factor of its information matrix.

    They hold to first order around the graph's poses, given that its information matrices are true and all
    its edges right.
    """

    graph: PoseGraph
    plan: Pattern
    diagonal: FloatArray
    below: FloatArray

    def marginals(self, poses: IntArray | None = None) -> FloatArray:
        """Return (K, 3, 3) covariances of x, y, theta in the map; by default of all poses.

        Those of fixed poses are zero.
        """
        k = np.arange(len(self.graph)) if poses is None else np.asarray(poses, dtype=np.int64)
        return self._blocks(k, k)[0]

    def relative(self, i: IntArray, j: IntArray) -> FloatArray:
        """Return (K, 3, 3) covariances of x, y, theta of pose j as seen from pose i."""
        i, j = np.asarray(i, dtype=np.int64), np.asarray(j, dtype=np.int64)
        return _seen(self.graph.poses[i], self.graph.poses[j], *self._blocks(i, j))

    def joint(self, poses: IntArray) -> JointCovariance:
        """Return that of x, y, theta in the map of some poses (C,)."""
        columns = self.plan.column[self._checked(poses)]
        factor = self.plan.column_start, self.plan.rows, self.diagonal, self.below
        return JointCovariance(self.graph.poses[poses], *inverse_columns(*factor, columns))

    def moved_by(self, measured: FloatArray, information: FloatArray) -> FloatArray:
        """(N, 3) by how much the poses change where the edges measure something else.

        Parameters
        ----------
        measured
            (M, 3) by how much the measurements change, each in its own frame.
        information
            (M, 3, 3) of what has changed: of an edge of several measurements that of one of them.
        """
        graph, column = self.graph, self.plan.column
        first, second = graph.poses[graph.i], graph.poses[graph.j]
        by_first, by_second = relative_jacobians(first, second, graph.measurements[:, 2])
        pull = np.einsum("mij,mj->mi", information, measured)
        right = np.zeros((len(graph), 3))
        np.add.at(right, graph.i, np.einsum("mij,mi->mj", by_first, pull))
        np.add.at(right, graph.j, np.einsum("mij,mi->mj", by_second, pull))
        free = column >= 0
        x = np.empty((len(self.diagonal), 3))
        x[column[free]] = right[free]
        factor = self.plan.column_start, self.plan.rows, self.diagonal, self.below
        solve_lower(*factor, x)
        solve_upper(*factor, x)
        out = np.zeros((len(graph), 3))
        out[free] = x[column[free]]
        return out

    def _checked(self, poses: IntArray) -> IntArray:
        index = np.asarray(poses, dtype=np.int64)
        if index.size and not (index.min() >= 0 and index.max() < len(self.graph)):
            raise InputError(f"covariances: expected poses 0 to {len(self.graph) - 1}, found others")
        return index

    def _blocks(self, i: IntArray, j: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return inverse_blocks(
            self.plan.column_start,
            self.plan.rows,
            self.diagonal,
            self.below,
            self.plan.column[self._checked(i)],
            self.plan.column[self._checked(j)],
        )


def covariances(
    graph: PoseGraph, *, fixed: BoolArray | None = None, weights: FloatArray | None = None
) -> PoseCovariances:
    """Factorize the information matrix of a graph at its poses.

    Parameters
    ----------
    fixed
        (N,) as in ``optimize``; the covariances are relative to these poses.
    weights
        (M,) how much each edge counts, such as the weights of a robust loss; by default 1.

    Raises
    ------
    InputError
        Where arrays do not fit, or the edges leave a pose undetermined.
    """
    plan = eliminate(graph, check_fixed(graph, fixed))
    information = graph.information
    if weights is not None:
        if weights.shape != graph.i.shape or not (weights >= 0.0).all():
            raise InputError(f"covariances: expected {graph.i.size} weights of at least 0")
        information = information * weights[:, None, None]
    n = plan.column_start.size - 1
    diagonal, below, right = np.empty((n, 9)), np.empty((plan.rows.size, 9)), np.empty((n, 3))
    edges = graph.edges._replace(information=information)
    no_doubts = Doubts(SQUARE, 1.0, np.zeros(graph.i.size, dtype=np.bool_))
    normal_equations(graph.poses, edges, no_doubts, plan, diagonal, below, right)
    done = factorize(plan.column_start, plan.rows, diagonal, below)
    if done != n:
        pose = int(np.flatnonzero(plan.column == -1 - done)[0])
        raise InputError(f"covariances: expected edges that determine all poses, found pose {pose} loose")
    return PoseCovariances(graph, plan, diagonal, below)


def _seen(
    first: FloatArray, second: FloatArray, own_first: FloatArray, own_second: FloatArray, mixed: FloatArray
) -> FloatArray:
    """Covariances (K, 3, 3) of poses (K, 3) as seen from others, by their blocks in the map (K, 3, 3)."""
    by_first, by_second = relative_jacobians(first, second)
    turned_first, turned_second = by_first.transpose(0, 2, 1), by_second.transpose(0, 2, 1)
    cross = by_first @ mixed @ turned_second
    out = by_first @ own_first @ turned_first + by_second @ own_second @ turned_second
    out += cross + cross.transpose(0, 2, 1)
    return np.asarray(0.5 * (out + out.transpose(0, 2, 1)))


def turns(theta_rad: FloatArray) -> FloatArray:
    """(..., 3, 3) that turn x and y of poses by angles (...)."""
    c, s = np.cos(theta_rad), np.sin(theta_rad)
    out = np.zeros((*theta_rad.shape, 3, 3))
    out[..., 0, 0] = out[..., 1, 1] = c
    out[..., 0, 1], out[..., 1, 0] = -s, s
    out[..., 2, 2] = 1.0
    return out


def relative_jacobians(
    first: FloatArray, second: FloatArray, turn_rad: float | FloatArray = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Jacobians (K, 3, 3) of x, y, theta of ``second`` seen from ``first``, (K, 3) each, by the two poses.

    x and y may be seen in axes that are turned by ``turn_rad`` (K,) against those of ``first``.
    """
    axes = first[:, 2] + turn_rad
    c, s = np.cos(axes), np.sin(axes)
    dx, dy = second[:, 0] - first[:, 0], second[:, 1] - first[:, 1]
    by_second = turns(-axes)
    by_first = -by_second
    by_first[:, 0, 2] = -s * dx + c * dy
    by_first[:, 1, 2] = -c * dx - s * dy
    return by_first, by_second
