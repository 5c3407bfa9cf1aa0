"""Planar pose graphs: poses and what was measured between pairs of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.slam.edges import Edges, squared_errors

LARGEST = 1e9
"""Metres or radians beyond which no pose is."""
ASYMMETRY = 1e-9


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Poses and relative measurements.

    Attributes
    ----------
    poses
        (N, 3) x, y, theta in the map.
    i, j
        (M,) the poses of each edge.
    measurements
        (M, 3) pose j as seen from pose i.
    information
        (M, 3, 3) inverse covariances of the logarithm of ``measurements^-1 (pose_i^-1 pose_j)``, symmetric
        and positive semi-definite.

    Raises
    ------
    InputError
        Where shapes do not fit, numbers are not finite, an edge names no pose or twice the same, or an
        information matrix is none.
    """

    poses: FloatArray
    i: IntArray
    j: IntArray
    measurements: FloatArray
    information: FloatArray

    def __post_init__(self) -> None:
        n, m = self.poses.shape[0], self.i.size
        shapes = {"poses": (n, 3), "i": (m,), "j": (m,), "measurements": (m, 3), "information": (m, 3, 3)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values.shape != shape:
                raise InputError(f"pose graph: expected {name} of shape {shape}, found {values.shape}")
            if values.dtype.kind == "f" and not np.isfinite(values).all():
                raise InputError(f"pose graph: expected finite {name}, found NaN or infinity")
        largest = max(np.abs(self.poses).max(initial=0.0), np.abs(self.measurements).max(initial=0.0))
        if largest > LARGEST:
            raise InputError(f"pose graph: expected poses within {LARGEST:g}, found {largest:g}")
        self._check_edges(n)

    def _check_edges(self, n: int) -> None:
        bad = np.flatnonzero((self.i < 0) | (self.i >= n) | (self.j < 0) | (self.j >= n))
        if bad.size:
            k = int(bad[0])
            raise InputError(
                f"pose graph: edge {k}: expected poses 0 to {n - 1}, found {self.i[k]}, {self.j[k]}"
            )
        bad = np.flatnonzero(self.i == self.j)
        if bad.size:
            raise InputError(f"pose graph: edge {bad[0]}: expected two poses, found twice {self.i[bad[0]]}")
        if self.i.size:
            bad = np.flatnonzero(~is_information(self.information))
            if bad.size:
                raise InputError(
                    f"pose graph: edge {bad[0]}: expected a symmetric, positive semi-definite information"
                )

    def __len__(self) -> int:
        return int(self.poses.shape[0])

    @property
    def edges(self) -> Edges:
        """The edges as the kernels take them."""
        return Edges(self.i, self.j, self.measurements, self.information)

    def squared_errors(self) -> FloatArray:
        """Return (M,) each edge's squared Mahalanobis distance; chi-square with 3 degrees of freedom."""
        return squared_errors(self.poses, self.edges)

    def components(self) -> IntArray:
        """Return (N,) the least pose of each pose's connected component."""
        least = np.arange(len(self), dtype=np.int64)
        while True:
            near = np.minimum(least[self.i], least[self.j])
            new = least.copy()
            np.minimum.at(new, self.i, near)
            np.minimum.at(new, self.j, near)
            new = new[new]
            if np.array_equal(new, least):
                return least
            least = new


def first_of_components(graph: PoseGraph) -> BoolArray:
    """Return (N,) which poses to hold fixed so that all others are determined: one a component."""
    return np.asarray(graph.components() == np.arange(len(graph)))


def is_information(matrices: FloatArray) -> BoolArray:
    """Return (M,) which of (M, 3, 3) are finite, symmetric and positive semi-definite up to rounding."""
    finite = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    known = np.where(finite[:, None, None], matrices, 0.0)
    size = np.abs(known).max(axis=(1, 2), initial=0.0)
    turned = np.abs(known - known.transpose(0, 2, 1)).max(axis=(1, 2), initial=0.0)
    least = np.linalg.eigvalsh(known)[:, 0]
    return np.asarray(finite & (turned <= ASYMMETRY * size) & (least >= -ASYMMETRY * size))
