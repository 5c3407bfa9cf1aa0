"""Start values of a planar pose graph that need no start values: two linear problems.

First the headings as free complex numbers, ``sum kappa |u_j - u_i exp(i theta_z)|^2``, then, with those
headings, the positions (Carlone, Tron, Daniilidis and Dellaert, "Initialization techniques for 3D SLAM",
ICRA 2015, the chordal relaxation). Both have the pattern of the pose graph, so that its factorization serves.
Wrong loop closures pull these start values as they pull any least squares.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.block_cholesky import factorize, solve_lower, solve_upper
from pilotage.kernels.slam.edges import Edges, Pattern


@kernel
def chordal_poses(poses: FloatArray, edges: Edges, pattern: Pattern) -> tuple[FloatArray, bool]:
    """Poses (N, 3) from the measurements alone; fixed ones are as in ``poses``.

    Returns
    -------
    The poses and whether both problems could be solved (their matrices were positive definite).
    """
    i, j, z, information = edges
    column, column_start, rows, places, turned = pattern
    n = column_start.size - 1
    out = poses.copy()
    diagonal, below, right = np.zeros((n, 9)), np.zeros((rows.size, 9)), np.zeros((n, 3))
    # The unused third number of each block is tied to zero.
    diagonal[:, 8] = 1.0
    m, block = np.empty((2, 2)), np.empty((2, 2))
    for k in range(i.size):
        # u_j - Z u_i = 0 with the turn Z.
        kappa = information[k, 2, 2]
        c, s = math.cos(z[k, 2]), math.sin(z[k, 2])
        m[0, 0] = m[1, 1] = kappa
        m[0, 1] = m[1, 0] = 0.0
        block[0, 0] = block[1, 1] = -kappa * c
        block[0, 1], block[1, 0] = -kappa * s, kappa * s
        a, b = column[i[k]], column[j[k]]
        _add(m, block, a, b, places[k], turned[k], diagonal, below)
        if a >= 0 > b:
            x, y = math.cos(out[j[k], 2]), math.sin(out[j[k], 2])
            right[a, 0] += kappa * (c * x + s * y)
            right[a, 1] += kappa * (-s * x + c * y)
        elif b >= 0 > a:
            x, y = math.cos(out[i[k], 2]), math.sin(out[i[k], 2])
            right[b, 0] += kappa * (c * x - s * y)
            right[b, 1] += kappa * (s * x + c * y)
    if factorize(column_start, rows, diagonal, below) != n:
        return out, False
    solve_lower(column_start, rows, diagonal, below, right)
    solve_upper(column_start, rows, diagonal, below, right)
    for p in range(poses.shape[0]):
        if column[p] >= 0:
            out[p, 2] = math.atan2(right[column[p], 1], right[column[p], 0])
    diagonal[:], below[:], right[:] = 0.0, 0.0, 0.0
    diagonal[:, 8] = 1.0
    for k in range(i.size):
        # Q (t_j - t_i) = Q d with d the measured shift in the map, Q its information there.
        angle = out[i[k], 2]
        c, s = math.cos(angle), math.sin(angle)
        dx, dy = c * z[k, 0] - s * z[k, 1], s * z[k, 0] + c * z[k, 1]
        c, s = math.cos(angle + z[k, 2]), math.sin(angle + z[k, 2])
        p, q, r = information[k, 0, 0], information[k, 0, 1], information[k, 1, 1]
        m[0, 0] = c * c * p - 2.0 * c * s * q + s * s * r
        m[1, 1] = s * s * p + 2.0 * c * s * q + c * c * r
        m[0, 1] = m[1, 0] = c * s * (p - r) + (c * c - s * s) * q
        block[:] = -m
        a, b = column[i[k]], column[j[k]]
        _add(m, block, a, b, places[k], turned[k], diagonal, below)
        if a >= 0:
            x, y = (0.0, 0.0) if b >= 0 else (out[j[k], 0], out[j[k], 1])
            right[a, 0] += m[0, 0] * (x - dx) + m[0, 1] * (y - dy)
            right[a, 1] += m[1, 0] * (x - dx) + m[1, 1] * (y - dy)
        if b >= 0:
            x, y = (0.0, 0.0) if a >= 0 else (out[i[k], 0], out[i[k], 1])
            right[b, 0] += m[0, 0] * (x + dx) + m[0, 1] * (y + dy)
            right[b, 1] += m[1, 0] * (x + dx) + m[1, 1] * (y + dy)
    if factorize(column_start, rows, diagonal, below) != n:
        return out, False
    solve_lower(column_start, rows, diagonal, below, right)
    solve_upper(column_start, rows, diagonal, below, right)
    for p in range(poses.shape[0]):
        if column[p] >= 0:
            out[p, 0], out[p, 1] = right[column[p], 0], right[column[p], 1]
    return out, True


@kernel
def _add(
    m: FloatArray,
    block: FloatArray,
    a: int,
    b: int,
    place: int,
    turned: int,
    diagonal: FloatArray,
    below: FloatArray,
) -> None:
    """Add ``m`` (2, 2) to both diagonal blocks and ``block``, which stands for row i, column j."""
    for r in range(2):
        for c in range(2):
            if a >= 0:
                diagonal[a, 3 * r + c] += m[r, c]
            if b >= 0:
                diagonal[b, 3 * r + c] += m[r, c]
            if place >= 0:
                below[place, 3 * r + c] += block[r, c] if turned else block[c, r]
