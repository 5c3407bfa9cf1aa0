"""Errors of the edges of a planar pose graph, their robust losses, and the normal equations.

Edge (i, j) with measurement z says that pose j, seen from pose i, is z. Its error is the logarithm of
``z^-1 (x_i^-1 x_j)`` in SE(2), as GTSAM's ``BetweenFactorPose2`` has it. (g2o takes x, y, theta of that
pose instead; the optimum's objective then differs by 1e-6 to 1e-5 of it on the usual benchmarks.) A pose is
updated by adding to its x, y and theta in the map. The objective is half the sum of ``rho(e' Omega e)``.

The logarithm of (u, phi) is ``(V(phi)^-1 u, phi)`` with ``V^-1 = [[a, phi/2], [-phi/2, a]]`` and
``a = (phi/2) cot(phi/2)`` (Sola and others, "A micro Lie theory", 2018, eq. 158).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel

SQUARE, HUBER, CAUCHY, GEMAN_MCCLURE, DCS = 0, 1, 2, 3, 4


class Edges(NamedTuple):
    """The edges of a graph: poses i and j (M,), measurements z (M, 3), information matrices (M, 3, 3)."""

    i: IntArray
    j: IntArray
    z: FloatArray
    information: FloatArray


class Doubts(NamedTuple):
    """Kind of a robust loss, its scale in standard deviations, and the edges (M,) that have it."""

    kind: int
    scale: float
    edges: BoolArray


class Pattern(NamedTuple):
    """Order of elimination of a graph and its factor's pattern; good for all poses of the same edges.

    Attributes
    ----------
    column
        (N,) the column of each pose in the factor, negative for a fixed one.
    column_start, rows
        Of the blocks below the diagonal, column by column.
    places, turned
        (M,) of the edges' blocks (``pattern_places``).
    """

    column: IntArray
    column_start: IntArray
    rows: IntArray
    places: IntArray
    turned: IntArray


@kernel
def robust(kind: int, scale: float, square: float) -> tuple[float, float]:
    """``rho(s)`` and its slope at ``s = e' Omega e``, with ``scale`` in standard deviations.

    Huber, Cauchy and Geman-McClure as in Zhang, "Parameter estimation techniques", 1997 (rho ~ s for small
    s); dynamic covariance scaling (DCS) after Agarwal and others, ICRA 2013, with ``Phi = scale^2``,
    as the loss that MacTavish and Barfoot (2015) give for it.
    """
    c = scale * scale
    if kind == HUBER:
        if square <= c:
            return square, 1.0
        root = math.sqrt(square)
        return 2.0 * scale * root - c, scale / root
    if kind == CAUCHY:
        return c * math.log1p(square / c), 1.0 / (1.0 + square / c)
    if kind == GEMAN_MCCLURE:
        w = c / (c + square)
        return square * w, w * w
    if kind == DCS:
        if square <= c:
            return square, 1.0
        w = 2.0 * c / (c + square)
        return 2.0 * square * w - c, w * w
    return square, 1.0


@kernel
def _difference(a: FloatArray, b: FloatArray, z: FloatArray) -> tuple[float, float, float]:
    """x, y and theta of ``z^-1 (a^-1 b)``, theta in [-pi, pi)."""
    c, s = math.cos(a[2]), math.sin(a[2])
    x, y = b[0] - a[0], b[1] - a[1]
    u, v = c * x + s * y - z[0], -s * x + c * y - z[1]
    cz, sz = math.cos(z[2]), math.sin(z[2])
    turn = b[2] - a[2] - z[2]
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    return cz * u + sz * v, -sz * u + cz * v, turn


@kernel
def _half_cotangent(phi: float) -> tuple[float, float]:
    """``(phi/2) cot(phi/2)`` and its derivative."""
    if abs(phi) < 1e-3:  # the next terms are below 1e-15
        return 1.0 - phi * phi / 12.0 - phi**4 / 720.0, -phi / 6.0 - phi**3 / 180.0
    half = 0.5 * phi
    c, s = math.cos(half), math.sin(half)
    return half * c / s, 0.5 * (c / s - half / (s * s))


@kernel
def edge_error(a: FloatArray, b: FloatArray, z: FloatArray, out: FloatArray) -> None:
    """Error (3,) of one edge between the poses ``a`` and ``b``."""
    u, v, phi = _difference(a, b, z)
    h, _ = _half_cotangent(phi)
    out[0] = h * u + 0.5 * phi * v
    out[1] = h * v - 0.5 * phi * u
    out[2] = phi


@kernel
def edge_jacobian(a: FloatArray, b: FloatArray, z: FloatArray, first: FloatArray, second: FloatArray) -> None:
    """Jacobians (3, 3) of ``edge_error`` by the two poses; they jump where theta is half a turn."""
    u, v, phi = _difference(a, b, z)
    h, slope = _half_cotangent(phi)
    half = 0.5 * phi
    # By the shift in the map: V^-1 R(theta_a + theta_z)'.
    c, s = math.cos(a[2] + z[2]), math.sin(a[2] + z[2])
    second[0, 0] = second[1, 1] = h * c - half * s
    second[0, 1] = h * s + half * c
    second[1, 0] = -second[0, 1]
    # By phi itself.
    second[0, 2] = slope * u + 0.5 * v
    second[1, 2] = slope * v - 0.5 * u
    second[2, 0] = second[2, 1] = 0.0
    second[2, 2] = 1.0
    x, y = b[0] - a[0], b[1] - a[1]
    first[:] = -second
    # Turning pose a by d shifts b by d (y, -x), seen in the map's axes.
    first[0, 2] += second[0, 0] * y - second[0, 1] * x
    first[1, 2] += second[1, 0] * y - second[1, 1] * x


@kernel
def squared_errors(poses: FloatArray, edges: Edges) -> FloatArray:
    """``e' Omega e`` of each edge: (M,)."""
    i, j, z, information = edges
    out = np.empty(i.size)
    e = np.empty(3)
    for k in range(i.size):
        edge_error(poses[i[k]], poses[j[k]], z[k], e)
        out[k] = _weighed(e, information[k])
    return out


@kernel
def _weighed(e: FloatArray, w: FloatArray) -> float:
    total: float = (
        w[0, 0] * e[0] * e[0]
        + w[1, 1] * e[1] * e[1]
        + w[2, 2] * e[2] * e[2]
        + 2.0 * (w[0, 1] * e[0] * e[1] + w[0, 2] * e[0] * e[2] + w[1, 2] * e[1] * e[2])
    )
    return total


@kernel
def objective(squares: FloatArray, doubts: Doubts) -> float:
    """Half the sum of the losses; only doubted edges have a robust one."""
    kind, scale, doubted = doubts
    total = 0.0
    for k in range(squares.size):
        total += robust(kind, scale, squares[k])[0] if doubted[k] else squares[k]
    return 0.5 * total


@kernel
def normal_equations(
    poses: FloatArray,
    edges: Edges,
    doubts: Doubts,
    pattern: Pattern,
    diagonal: FloatArray,
    below: FloatArray,
    right: FloatArray,
) -> None:
    """Normal equations ``H dx = right`` of the step from ``poses``, edges weighed by their loss's slope.

    ``diagonal`` (n, 9), ``below`` (L, 9) and ``right`` (n, 3) are overwritten.
    """
    i, j, z, information = edges
    kind, scale, doubted = doubts
    column, places, turned = pattern.column, pattern.places, pattern.turned
    diagonal[:] = 0.0
    below[:] = 0.0
    right[:] = 0.0
    e = np.empty(3)
    first, second = np.empty((3, 3)), np.empty((3, 3))
    weighed_first, weighed_second = np.empty((3, 3)), np.empty((3, 3))
    for k in range(i.size):
        a, b = column[i[k]], column[j[k]]
        if a < 0 and b < 0:
            continue
        omega = information[k]
        edge_error(poses[i[k]], poses[j[k]], z[k], e)
        edge_jacobian(poses[i[k]], poses[j[k]], z[k], first, second)
        w = robust(kind, scale, _weighed(e, omega))[1] if doubted[k] else 1.0
        for r in range(3):
            for c in range(3):
                weighed_first[r, c] = w * (
                    omega[r, 0] * first[0, c] + omega[r, 1] * first[1, c] + omega[r, 2] * first[2, c]
                )
                weighed_second[r, c] = w * (
                    omega[r, 0] * second[0, c] + omega[r, 1] * second[1, c] + omega[r, 2] * second[2, c]
                )
        if a >= 0:
            _add_product(first, weighed_first, diagonal[a])
            _add_right(weighed_first, e, right[a])
        if b >= 0:
            _add_product(second, weighed_second, diagonal[b])
            _add_right(weighed_second, e, right[b])
        if places[k] >= 0:
            if turned[k]:
                _add_product(first, weighed_second, below[places[k]])
            else:
                _add_product(second, weighed_first, below[places[k]])


@kernel
def _add_product(left: FloatArray, right: FloatArray, out: FloatArray) -> None:
    """Add ``left' right`` to a block of 9 numbers."""
    for r in range(3):
        for c in range(3):
            out[3 * r + c] += left[0, r] * right[0, c] + left[1, r] * right[1, c] + left[2, r] * right[2, c]


@kernel
def _add_right(weighed: FloatArray, e: FloatArray, out: FloatArray) -> None:
    for c in range(3):
        out[c] -= weighed[0, c] * e[0] + weighed[1, c] * e[1] + weighed[2, c] * e[2]


@kernel
def weights(squares: FloatArray, doubts: Doubts) -> FloatArray:
    """Slope of the loss of each edge: (M,)."""
    kind, scale, doubted = doubts
    out = np.ones(squares.size)
    for k in range(squares.size):
        if doubted[k]:
            out[k] = robust(kind, scale, squares[k])[1]
    return out
