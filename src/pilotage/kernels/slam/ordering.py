"""In which order the poses are eliminated, and the pattern of the Cholesky factor that follows.

Approximate minimum degree on the quotient graph (Amestoy, Davis and Duff, "An approximate minimum degree
ordering algorithm", SIAM J. Matrix Anal. Appl. 17, 1996), on the graph of the 3x3 blocks: of the variables
left the one with (about) the fewest neighbours goes next, and its neighbours become a clique, kept as one
*element* instead of as its edges. The element's variables are just the rows of the factor's column, so that
the symbolic factorization comes with the ordering. Without that paper's supervariables: the blocks are few
enough.

Two neighbours count like one, and of equals the one that was touched last goes last: a path is then
eliminated all along its length in turn, not from its end on, and of n poses none is further than some log n
columns from the root of the elimination tree. That is what the inverse's blocks cost (``covariances``).
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import IntArray
from pilotage.kernels.jit import kernel

ALIKE = 2
"""Poses with at most so many neighbours go first: none of them makes the graph have more edges."""


@kernel
def adjacency(n: int, i: IntArray, j: IntArray) -> tuple[IntArray, IntArray]:
    """Neighbours of each of ``n`` nodes by the edges ``i``, ``j`` (M,), each once and ascending.

    Edges with a node below 0 (a fixed pose) or from a node to itself do not count.

    Returns
    -------
    (n + 1,) where each node's neighbours begin, and the neighbours.
    """
    count = np.zeros(n + 1, np.int64)
    for e in range(i.size):
        if i[e] >= 0 and j[e] >= 0 and i[e] != j[e]:
            count[i[e] + 1] += 1
            count[j[e] + 1] += 1
    for k in range(n):
        count[k + 1] += count[k]
    place = count[:-1].copy()
    full = np.empty(count[n], np.int64)
    for e in range(i.size):
        if i[e] >= 0 and j[e] >= 0 and i[e] != j[e]:
            full[place[i[e]]] = j[e]
            place[i[e]] += 1
            full[place[j[e]]] = i[e]
            place[j[e]] += 1
    start = np.zeros(n + 1, np.int64)
    kept = 0
    for k in range(n):
        row = np.sort(full[count[k] : count[k + 1]])
        for q in range(row.size):
            if q == 0 or row[q] != row[q - 1]:
                full[kept] = row[q]  # never overtakes what is still to be read
                kept += 1
        start[k + 1] = kept
    return start, full[:kept].copy()


@kernel
def _unlink(
    i: int, degree: IntArray, head: IntArray, tail: IntArray, after: IntArray, before: IntArray
) -> None:
    if before[i] >= 0:
        after[before[i]] = after[i]
    else:
        head[degree[i]] = after[i]
    if after[i] >= 0:
        before[after[i]] = before[i]
    else:
        tail[degree[i]] = before[i]


@kernel
def _link(
    i: int, degree: IntArray, head: IntArray, tail: IntArray, after: IntArray, before: IntArray
) -> None:
    last = tail[degree[i]]
    before[i] = last
    after[i] = -1
    if last >= 0:
        after[last] = i
    else:
        head[degree[i]] = i
    tail[degree[i]] = i


@kernel
def minimum_degree(start: IntArray, neighbours: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Order the nodes of a graph (``adjacency``) for elimination.

    Returns
    -------
    order
        (n,) the k-th variable to be eliminated.
    column_start, rows
        (n + 1,), (L,): the rows below the diagonal of the factor's column k, in the new numbers, ascending.
    """
    n = start.size - 1
    # Each variable's own list, in place of its neighbours: first its elements, then its variables. Whenever
    # it gains an element, it loses at least one entry, so that the place suffices.
    items = neighbours.copy()
    elements = np.zeros(n, np.int64)
    length = start[1:] - start[:-1]
    degree = np.maximum(length, ALIKE)
    # Variables of the same degree, as queues.
    head, tail = np.full(n + ALIKE + 1, -1), np.full(n + ALIKE + 1, -1)
    after, before = np.full(n, -1), np.full(n, -1)
    for i in range(n):
        _link(i, degree, head, tail, after, before)
    pool = np.empty(max(16, 4 * neighbours.size), np.int64)  # the elements' variables
    pool_start, pool_end = np.zeros(n, np.int64), np.zeros(n, np.int64)
    size = np.zeros(n, np.int64)  # of an element; none of its variables goes before it is absorbed
    alive = np.ones(n, np.bool_)  # an element that no other one has absorbed
    mark, outside = np.full(n, -1), np.full(n, -1)
    outside_at = np.full(n, -1)
    order, rank = np.empty(n, np.int64), np.full(n, -1)
    used, least = 0, 0
    for step in range(n):
        while head[least] < 0:
            least += 1
        p = head[least]
        _unlink(p, degree, head, tail, after, before)
        order[step], rank[p] = p, step
        # The new element: all that p touches.
        first = used
        mark[p] = step
        for q in range(start[p], start[p] + length[p]):
            if q < start[p] + elements[p]:
                e = items[q]
                begin, end = pool_start[e], pool_end[e]
            else:
                begin, end, e = q, q + 1, -1
            if used + end - begin > pool.size:
                larger = np.empty(2 * pool.size + end - begin, np.int64)
                larger[:used] = pool[:used]
                pool = larger
            for r in range(begin, end):
                i = pool[r] if e >= 0 else items[r]
                if rank[i] < 0 and mark[i] != step:
                    mark[i] = step
                    pool[used] = i
                    used += 1
            if e >= 0:
                alive[e] = False
        pool_start[p], pool_end[p] = first, used
        size[p] = used - first
        # How much of each other element lies outside the new one.
        for r in range(first, used):
            i = pool[r]
            for q in range(start[i], start[i] + elements[i]):
                e = items[q]
                if alive[e]:
                    if outside_at[e] != step:
                        outside_at[e] = step
                        outside[e] = size[e]
                    outside[e] -= 1
        for r in range(first, used):
            i = pool[r]
            _unlink(i, degree, head, tail, after, before)
            begin = start[i]
            middle, end = begin + elements[i], begin + length[i]
            kept, bound = begin, size[p] - 1
            for q in range(begin, middle):
                e = items[q]
                if alive[e] and outside[e] > 0:
                    items[kept] = e
                    kept += 1
                    bound += outside[e]
            new_elements = kept - begin
            first_variable = -1
            for q in range(middle, end):
                other = items[q]
                # Edges within the new element are its own now.
                if rank[other] < 0 and mark[other] != step:
                    if first_variable < 0:
                        first_variable = kept
                    items[kept] = other
                    kept += 1
                    bound += 1
            # The new element goes behind the others; the first variable makes room for it.
            if first_variable >= 0:
                items[kept] = items[first_variable]
                items[first_variable] = p
            else:
                items[kept] = p
            elements[i] = new_elements + 1
            length[i] = kept + 1 - begin
            degree[i] = max(ALIKE, min(bound, degree[i] + size[p] - 1, n - step - 2))
            _link(i, degree, head, tail, after, before)
            least = min(least, degree[i])
    column_start = np.zeros(n + 1, np.int64)
    rows = np.empty(used, np.int64)
    for step in range(n):
        p = order[step]
        begin = column_start[step]
        end = begin + pool_end[p] - pool_start[p]
        for q in range(pool_start[p], pool_end[p]):
            rows[begin + q - pool_start[p]] = rank[pool[q]]
        rows[begin:end] = np.sort(rows[begin:end])
        column_start[step + 1] = end
    return order, column_start, rows
