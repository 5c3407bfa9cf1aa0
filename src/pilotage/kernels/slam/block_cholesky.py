"""Cholesky's factor of a sparse symmetric matrix of 3x3 blocks, and what is solved with it.

Left-looking by columns (Davis, "Direct methods for sparse linear systems", SIAM 2006, chapter 4): column j
takes the updates of all columns before it that have a row j. A block is a row of 9 numbers, row by row.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

NOT_POSITIVE = -1


@kernel
def pattern_places(
    order: IntArray, column_start: IntArray, rows: IntArray, i: IntArray, j: IntArray
) -> tuple[IntArray, IntArray]:
    """Where each edge's block lies in the factor's pattern.

    Parameters
    ----------
    order, column_start, rows
        As ``minimum_degree`` returns them.
    i, j
        (M,) variables of the edges, negative for a fixed pose.

    Returns
    -------
    places
        (M,) index into ``rows``, or -1 for an edge without such a block.
    turned
        (M,) 1 where the block stands for (i, j) as (row, column), 0 for (j, i).
    """
    n = order.size
    rank = np.empty(n, np.int64)
    for k in range(n):
        rank[order[k]] = k
    places, turned = np.full(i.size, -1), np.zeros(i.size, np.int64)
    for e in range(i.size):
        if i[e] < 0 or j[e] < 0 or i[e] == j[e]:
            continue
        a, b = rank[i[e]], rank[j[e]]
        column, row = min(a, b), max(a, b)
        turned[e] = 1 if a > b else 0
        low, high = column_start[column], column_start[column + 1]
        while low < high:
            middle = (low + high) // 2
            if rows[middle] < row:
                low = middle + 1
            else:
                high = middle
        places[e] = low
    return places, turned


@kernel
def factorize(column_start: IntArray, rows: IntArray, diagonal: FloatArray, below: FloatArray) -> int:
    """Turn a matrix into its factor L with L L' = A, in place.

    Parameters
    ----------
    column_start, rows
        The factor's pattern.
    diagonal
        (n, 9) the matrix's diagonal blocks; becomes the lower triangular blocks of L.
    below
        (L, 9) its blocks below the diagonal, zero where only the factor has one; becomes those of L.

    Returns
    -------
    n, or the first column in which the matrix turned out not to be positive definite, as -1 - column.
    """
    n = len(diagonal)
    place = np.empty(n, np.int64)  # of a row within the column in work
    head = np.full(n, -1)  # columns whose next row to be used is this one, as a list
    after = np.full(n, -1)
    following = column_start[:-1].copy()
    for j in range(n):
        begin, end = column_start[j], column_start[j + 1]
        for q in range(begin, end):
            place[rows[q]] = q
        d = diagonal[j]
        k = head[j]
        while k >= 0:
            next_column = after[k]
            p = following[k]
            last = column_start[k + 1]
            a0, a1, a2 = below[p, 0], below[p, 1], below[p, 2]
            b0, b1, b2 = below[p, 3], below[p, 4], below[p, 5]
            c0, c1, c2 = below[p, 6], below[p, 7], below[p, 8]
            d[0] -= a0 * a0 + a1 * a1 + a2 * a2
            d[3] -= b0 * a0 + b1 * a1 + b2 * a2
            d[4] -= b0 * b0 + b1 * b1 + b2 * b2
            d[6] -= c0 * a0 + c1 * a1 + c2 * a2
            d[7] -= c0 * b0 + c1 * b1 + c2 * b2
            d[8] -= c0 * c0 + c1 * c1 + c2 * c2
            for q in range(p + 1, last):
                source = below[q]
                target = below[place[rows[q]]]
                for r in (0, 3, 6):
                    s0, s1, s2 = source[r], source[r + 1], source[r + 2]
                    target[r] -= s0 * a0 + s1 * a1 + s2 * a2
                    target[r + 1] -= s0 * b0 + s1 * b1 + s2 * b2
                    target[r + 2] -= s0 * c0 + s1 * c1 + s2 * c2
            following[k] = p + 1
            if p + 1 < last:
                row = rows[p + 1]
                after[k] = head[row]
                head[row] = k
            k = next_column
        if not _cholesky3(d):
            return -1 - j
        l00, l10, l11, l20, l21, l22 = 1.0 / d[0], d[3], 1.0 / d[4], d[6], d[7], 1.0 / d[8]
        for q in range(begin, end):
            b = below[q]
            for r in (0, 3, 6):  # b L^-T, row by row
                x = b[r] * l00
                y = (b[r + 1] - x * l10) * l11
                b[r] = x
                b[r + 1] = y
                b[r + 2] = (b[r + 2] - x * l20 - y * l21) * l22
        if begin < end:
            row = rows[begin]
            after[j] = head[row]
            head[row] = j
    return n


@kernel
def _cholesky3(d: FloatArray) -> bool:
    """Factor of one block in place, its upper triangle set to zero; False where it is not positive."""
    if not d[0] > 0.0:
        return False
    d[0] = math.sqrt(d[0])
    d[3] /= d[0]
    d[6] /= d[0]
    rest = d[4] - d[3] * d[3]
    if not rest > 0.0:
        return False
    d[4] = math.sqrt(rest)
    d[7] = (d[7] - d[6] * d[3]) / d[4]
    rest = d[8] - d[6] * d[6] - d[7] * d[7]
    if not (rest > 0.0 and rest < np.inf):
        return False
    d[8] = math.sqrt(rest)
    d[1] = d[2] = d[5] = 0.0
    return True


@kernel
def solve_lower(
    column_start: IntArray, rows: IntArray, diagonal: FloatArray, below: FloatArray, x: FloatArray
) -> None:
    """Solve L y = x in place; ``x`` is (n, 3) in the factor's order."""
    for j in range(diagonal.shape[0]):
        d, y = diagonal[j], x[j]
        y[0] = y[0] / d[0]
        y[1] = (y[1] - d[3] * y[0]) / d[4]
        y[2] = (y[2] - d[6] * y[0] - d[7] * y[1]) / d[8]
        for q in range(column_start[j], column_start[j + 1]):
            b, z = below[q], x[rows[q]]
            z[0] -= b[0] * y[0] + b[1] * y[1] + b[2] * y[2]
            z[1] -= b[3] * y[0] + b[4] * y[1] + b[5] * y[2]
            z[2] -= b[6] * y[0] + b[7] * y[1] + b[8] * y[2]


@kernel
def solve_upper(
    column_start: IntArray, rows: IntArray, diagonal: FloatArray, below: FloatArray, x: FloatArray
) -> None:
    """Solve L' y = x in place; ``x`` is (n, 3) in the factor's order."""
    for j in range(diagonal.shape[0] - 1, -1, -1):
        d, y = diagonal[j], x[j]
        for q in range(column_start[j], column_start[j + 1]):
            b, z = below[q], x[rows[q]]
            y[0] -= b[0] * z[0] + b[3] * z[1] + b[6] * z[2]
            y[1] -= b[1] * z[0] + b[4] * z[1] + b[7] * z[2]
            y[2] -= b[2] * z[0] + b[5] * z[1] + b[8] * z[2]
        y[2] = y[2] / d[8]
        y[1] = (y[1] - d[7] * y[2]) / d[4]
        y[0] = (y[0] - d[3] * y[1] - d[6] * y[2]) / d[0]
