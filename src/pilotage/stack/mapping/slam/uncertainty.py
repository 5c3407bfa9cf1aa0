"""Edges of the mapper's graph, and how much alignments tell."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.models.pose_graph import PoseGraph
from pilotage.models.pose_graph_covariance import turns

TRACK_STD_M = 0.03
"""What the residual of a point counts as that is aligned with keyframes along the path."""
LEAST_INFORMATION = np.diag([1.0, 1.0, 1.0])
"""One metre, one radian: where an alignment tells nothing, the solver has a system all the same."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Relative measurements as in ``PoseGraph``, and which of them close a loop.

    Attributes
    ----------
    odometry
        (M, 3, 3) what of the information an odometry tells; None: nothing. How unsure that is was measured,
        where alignments are as unsure as their residuals, and loops, show in the end (``calibrated``).
    """

    i: IntArray
    j: IntArray
    relative: FloatArray
    information: FloatArray
    closes: BoolArray
    odometry: FloatArray | None = None

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
            np.concatenate([self.by_odometry, other.by_odometry]),
        )

    @property
    def by_odometry(self) -> FloatArray:
        """``odometry``, zero where it tells nothing."""
        return np.zeros_like(self.information) if self.odometry is None else self.odometry

    def scaled(self, factor: float | FloatArray) -> Edges:
        """Return them with all information multiplied, by one factor or by one each (M,)."""
        each = np.reshape(factor, (-1, 1, 1))
        return replace(self, information=self.information * each, odometry=self.by_odometry * each)

    def calibrated(self, variance_factor: float) -> Edges:
        """Return them with alignments as unsure as this factor of their variances says."""
        told = self.by_odometry
        return replace(self, information=(self.information - told) / variance_factor + told)

    def chosen(self, which: BoolArray) -> Edges:
        """Return some of them."""
        return Edges(
            self.i[which],
            self.j[which],
            self.relative[which],
            self.information[which],
            self.closes[which],
            self.by_odometry[which],
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
    turn = turns(theta_rad)
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


def errors_of(edges: Edges, poses: FloatArray) -> FloatArray:
    """(M, 3) predicted minus measured, in the frame of each measurement."""
    predicted = relative_poses(poses[edges.i], poses[edges.j])
    return relative_poses(edges.relative, predicted)


def agreeing(edges: Edges, others: Edges, probability: float) -> Edges:
    """Return other edges between the same poses, which tell nothing where the two contradict each other.

    ``probability``: of the chi-square of what they are apart, up to which they agree.
    """
    apart = relative_poses(edges.relative, others.relative)
    tells = others.information.any(axis=(1, 2))
    spread = np.linalg.inv(edges.information[tells]) + np.linalg.inv(others.information[tells])
    squares = np.zeros(len(edges))
    squares[tells] = np.einsum("mi,mij,mj->m", apart[tells], np.linalg.inv(spread), apart[tells])
    agrees = squares <= chi_square_quantile(probability, 3)
    return replace(others, information=np.where(agrees[:, None, None], others.information, 0.0))


def fused(edges: Edges, others: Edges) -> Edges:
    """Return one edge for two between the same poses each: their mean by their information.

    The two are near each other: the frame of the one is taken for that of the other.
    """
    information = edges.information + others.information
    apart = relative_poses(edges.relative, others.relative)
    pull = np.einsum("mij,mj->mi", others.information, apart)
    step = np.linalg.solve(information, pull[:, :, None])[:, :, 0]
    c, s = np.cos(edges.relative[:, 2]), np.sin(edges.relative[:, 2])
    moved = np.stack([c * step[:, 0] - s * step[:, 1], s * step[:, 0] + c * step[:, 1], step[:, 2]], axis=1)
    relative = edges.relative + moved
    relative[:, 2] = (relative[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return replace(edges, relative=relative, information=information)
