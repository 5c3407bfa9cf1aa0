"""Blocks of the inverse of a sparse matrix from its Cholesky factor.

``A^-1 = L^-T L^-1``, so that the block of the variables i and j is ``(L^-1 E_i)' (L^-1 E_j)``. Of
``L^-1 E_i`` only the columns on i's path to the root of the elimination tree are not zero (Gilbert and
Peierls 1988; Kaess and Dellaert, "Covariance recovery from a square root information matrix", RAS 2009, go
the same way backwards): a block costs what that path holds, wherever the two poses are.
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def inverse_blocks(
    column_start: IntArray,
    rows: IntArray,
    diagonal: FloatArray,
    below: FloatArray,
    first: IntArray,
    second: IntArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Blocks of the inverse for pairs of columns.

    Parameters
    ----------
    column_start, rows, diagonal, below
        A factor (``factorize``).
    first, second
        (K,) columns; negative: a fixed pose, whose blocks are zero. Pairs with the same ``first`` one after
        another share work.

    Returns
    -------
    (K, 3, 3) each: the blocks (first, first), (second, second) and (first, second).
    """
    n = len(diagonal)
    count = first.size
    own_first, own_second = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    mixed = np.zeros((count, 3, 3))
    y, z = np.zeros((n, 9)), np.zeros((n, 9))
    for k in range(count):
        a, b = first[k], second[k]
        if k == 0 or a != first[k - 1]:
            if k > 0:
                _clear_path(column_start, rows, first[k - 1], y)
            _solve_path(column_start, rows, diagonal, below, a, y)
            _add_path_product(column_start, rows, a, y, y, own_first[k])
        else:
            own_first[k] = own_first[k - 1]
        if b == a:
            own_second[k], mixed[k] = own_first[k], own_first[k]
            continue
        _solve_path(column_start, rows, diagonal, below, b, z)
        _add_path_product(column_start, rows, b, z, z, own_second[k])
        if a >= 0:
            _add_path_product(column_start, rows, b, y, z, mixed[k])
        _clear_path(column_start, rows, b, z)
    return own_first, own_second, mixed


@kernel
def inverse_columns(
    column_start: IntArray, rows: IntArray, diagonal: FloatArray, below: FloatArray, chosen: IntArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """``L^-1 E_c`` of ``chosen`` columns (C,), each on its path alone. Arguments as in ``inverse_blocks``.

    Returns
    -------
    starts
        (C + 1,) where each one's path begins; a fixed pose has none.
    path, columns
        (P,) the paths, each from its column to the root, and (P, 9) the blocks there.
    """
    count = chosen.size
    starts, total = np.zeros(count + 1, np.int64), 0
    for k in range(count):
        c = chosen[k]
        while c >= 0:
            total += 1
            c = _parent(column_start, rows, c)
        starts[k + 1] = total
    path, columns = np.empty(total, np.int64), np.empty((total, 9))
    y = np.zeros((len(diagonal), 9))
    for k in range(count):
        _solve_path(column_start, rows, diagonal, below, chosen[k], y)
        c = chosen[k]
        for q in range(starts[k], starts[k + 1]):
            path[q], columns[q] = c, y[c]
            c = _parent(column_start, rows, c)
        _clear_path(column_start, rows, chosen[k], y)
    return starts, path, columns


@kernel
def column_products(
    starts: IntArray, path: IntArray, columns: FloatArray, first: IntArray, second: IntArray
) -> FloatArray:
    """Blocks (K, 3, 3) of the inverse, rows of ``first`` (K,) and columns of ``second`` of those chosen.

    Two paths that have met stay together to the root.
    """
    out = np.zeros((first.size, 3, 3))
    for k in range(first.size):
        a, b = starts[first[k] + 1] - 1, starts[second[k] + 1] - 1
        while a >= starts[first[k]] and b >= starts[second[k]] and path[a] == path[b]:
            v, w = columns[a], columns[b]
            for r in range(3):
                for s in range(3):
                    out[k, r, s] += v[r] * w[s] + v[3 + r] * w[3 + s] + v[6 + r] * w[6 + s]
            a -= 1
            b -= 1
    return out


@kernel
def joint_products(starts: IntArray, path: IntArray, columns: FloatArray, chosen: IntArray) -> FloatArray:
    """Covariance (3 K, 3 K) of some (K,) of the chosen columns, by ``column_products`` of each two."""
    count = chosen.size
    out = np.empty((3 * count, 3 * count))
    others = np.empty(count, np.int64)
    for k in range(count):
        others[:] = chosen[k]
        blocks = column_products(starts, path, columns, others[k:], chosen[k:])
        for m in range(k, count):
            for r in range(3):
                for s in range(3):
                    out[3 * k + r, 3 * m + s] = out[3 * m + s, 3 * k + r] = blocks[m - k, r, s]
    return out


@kernel
def _parent(column_start: IntArray, rows: IntArray, c: int) -> int:
    """The next column on the path to the root of the elimination tree, or -1."""
    return rows[column_start[c]] if column_start[c] < column_start[c + 1] else -1


@kernel
def _solve_path(
    column_start: IntArray,
    rows: IntArray,
    diagonal: FloatArray,
    below: FloatArray,
    c: int,
    y: FloatArray,
) -> None:
    """Write ``L^-1 E_c`` into ``y`` (n, 9), which is zero before."""
    if c >= 0:
        y[c, 0] = y[c, 4] = y[c, 8] = 1.0
    while c >= 0:
        d, v = diagonal[c], y[c]
        for r in range(3):
            v[r] /= d[0]
            v[3 + r] = (v[3 + r] - d[3] * v[r]) / d[4]
            v[6 + r] = (v[6 + r] - d[6] * v[r] - d[7] * v[3 + r]) / d[8]
        for q in range(column_start[c], column_start[c + 1]):
            b, w = below[q], y[rows[q]]
            for r in (0, 3, 6):
                for s in range(3):
                    w[r + s] -= b[r] * v[s] + b[r + 1] * v[3 + s] + b[r + 2] * v[6 + s]
        c = _parent(column_start, rows, c)


@kernel
def _add_path_product(
    column_start: IntArray, rows: IntArray, c: int, y: FloatArray, z: FloatArray, out: FloatArray
) -> None:
    """Add ``y' z`` over the path from ``c``."""
    while c >= 0:
        v, w = y[c], z[c]
        for r in range(3):
            for s in range(3):
                out[r, s] += v[r] * w[s] + v[3 + r] * w[3 + s] + v[6 + r] * w[6 + s]
        c = _parent(column_start, rows, c)


@kernel
def _clear_path(column_start: IntArray, rows: IntArray, c: int, y: FloatArray) -> None:
    while c >= 0:
        y[c] = 0.0
        c = _parent(column_start, rows, c)
