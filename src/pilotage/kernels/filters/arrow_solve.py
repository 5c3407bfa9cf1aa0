"""Least squares over a chain of blocks that all touch a few shared unknowns: the normal matrix is an arrow.

A robot's poses form a chain (each is tied to the next by odometry) and what they saw is shared by all:
landmarks, scale factors. Ordered chain first, the normal matrix is block tridiagonal with a dense border,
and Cholesky's factor keeps that shape (Golub and Van Loan, section 4.3; Triggs and others 2000, section 6):
the cost grows with the length of the chain, not with its cube.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

SOLVED = 0
NOT_POSITIVE = 1
"""The matrix is singular: something is not tied to anything."""


class Arrow(NamedTuple):
    """A chain of N blocks of m unknowns and G unknowns that all share: normal matrix and right-hand sides.

    Attributes
    ----------
    diagonal
        (N, m, m) blocks of the chain.
    coupling
        (N, m, m): entry i couples block i (rows) with block i + 1 (columns).
    border
        (N, m, G) couples block i with the shared unknowns.
    corner
        (G, G) of the shared unknowns.
    right, right_corner
        (N, m) and (G,) right-hand sides.
    """

    diagonal: FloatArray
    coupling: FloatArray
    border: FloatArray
    corner: FloatArray
    right: FloatArray
    right_corner: FloatArray


def no_arrow(blocks: int, m: int, shared: int) -> Arrow:
    """Nothing but zeros, to add factors to."""
    return Arrow(
        np.zeros((blocks, m, m)),
        np.zeros((blocks, m, m)),
        np.zeros((blocks, m, shared)),
        np.zeros((shared, shared)),
        np.zeros((blocks, m)),
        np.zeros(shared),
    )


@kernel
def cholesky(a: FloatArray, n: int) -> bool:
    """Turn the lower triangle of ``a`` (n, n) into its Cholesky factor; False where it is not positive."""
    for j in range(n):
        for k in range(j):
            factor = a[j, k]
            for i in range(j, n):
                a[i, j] -= a[i, k] * factor
        if not a[j, j] > 0.0:
            return False
        root = math.sqrt(a[j, j])
        for i in range(j, n):
            a[i, j] /= root
    return True


@kernel
def solve_arrow(arrow: Arrow) -> int:
    """Solve in place; ``SOLVED`` or ``NOT_POSITIVE``.

    Afterwards the right-hand sides hold the solution, ``diagonal`` the Cholesky factors of its blocks, and
    ``corner`` that of the shared unknowns' Schur complement, whose inverse is their covariance.
    """
    diagonal, coupling, border, corner = arrow.diagonal, arrow.coupling, arrow.border, arrow.corner
    right, right_corner = arrow.right, arrow.right_corner
    blocks, shared = diagonal.shape[0], corner.shape[0]
    m = diagonal.shape[1]
    for i in range(blocks):
        block = diagonal[i]
        if not cholesky(block, m):
            return NOT_POSITIVE
        # Forward substitution of everything to the right of this block.
        for r in range(m):
            for k in range(r):
                factor = block[r, k]
                right[i, r] -= factor * right[i, k]
                for c in range(m):
                    coupling[i, r, c] -= factor * coupling[i, k, c]
                for c in range(shared):
                    border[i, r, c] -= factor * border[i, k, c]
            scale = 1.0 / block[r, r]
            right[i, r] *= scale
            for c in range(m):
                coupling[i, r, c] *= scale
            for c in range(shared):
                border[i, r, c] *= scale
        if i + 1 < blocks:
            for k in range(m):
                for r in range(m):
                    factor = coupling[i, k, r]
                    if factor == 0.0:
                        continue
                    right[i + 1, r] -= factor * right[i, k]
                    for c in range(r + 1):
                        diagonal[i + 1, r, c] -= factor * coupling[i, k, c]
                    for c in range(shared):
                        border[i + 1, r, c] -= factor * border[i, k, c]
        for k in range(m):
            for r in range(shared):
                factor = border[i, k, r]
                if factor == 0.0:
                    continue
                right_corner[r] -= factor * right[i, k]
                for c in range(r + 1):
                    corner[r, c] -= factor * border[i, k, c]
    if not cholesky(corner, shared):
        return NOT_POSITIVE
    substitute(corner, right_corner, shared)
    for i in range(blocks - 1, -1, -1):
        block = diagonal[i]
        for r in range(m - 1, -1, -1):
            value = right[i, r]
            for c in range(shared):
                value -= border[i, r, c] * right_corner[c]
            if i + 1 < blocks:
                for c in range(m):
                    value -= coupling[i, r, c] * right[i + 1, c]
            for k in range(r + 1, m):
                value -= block[k, r] * right[i, k]
            right[i, r] = value / block[r, r]
    return SOLVED


@kernel
def substitute(factor: FloatArray, right: FloatArray, n: int) -> None:
    """Solve L L^T x = right (n,) in place, ``factor`` (n, n) holding L in its lower triangle."""
    for r in range(n):
        value = right[r]
        for c in range(r):
            value -= factor[r, c] * right[c]
        right[r] = value / factor[r, r]
    for r in range(n - 1, -1, -1):
        value = right[r]
        for c in range(r + 1, n):
            value -= factor[c, r] * right[c]
        right[r] = value / factor[r, r]


@kernel
def last_block_cov(arrow: Arrow) -> FloatArray:
    """(m, m) covariance of the chain's last block, from the factors that ``solve_arrow`` left."""
    block, border, corner = arrow.diagonal[-1], arrow.border[-1], arrow.corner
    m, shared = block.shape[0], corner.shape[0]
    cov = np.empty((m, m))
    for column in range(m):
        # Rows above are eliminated: a unit right-hand side in the last block touches nothing before it.
        own = np.zeros(m)
        own[column] = 1.0
        for r in range(m):
            for k in range(r):
                own[r] -= block[r, k] * own[k]
            own[r] /= block[r, r]
        beyond = np.zeros(shared)
        for c in range(shared):
            for k in range(m):
                beyond[c] -= border[k, c] * own[k]
        substitute(corner, beyond, shared)
        for r in range(m - 1, -1, -1):
            value = own[r]
            for c in range(shared):
                value -= border[r, c] * beyond[c]
            for k in range(r + 1, m):
                value -= block[k, r] * own[k]
            own[r] = value / block[r, r]
        cov[:, column] = own
    return cov
