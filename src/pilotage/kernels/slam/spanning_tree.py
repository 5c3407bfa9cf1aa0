"""Poses along a breadth-first tree of a pose graph: few measurements between a pose and its root."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def spanning_tree_poses(
    poses: FloatArray, known: BoolArray, i: IntArray, j: IntArray, z: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Lay out what the ``known`` poses (N,) reach by edges.

    Returns
    -------
    Poses (N, 3), those that were not reached as they were, and which (N,) are known now.
    """
    n = poses.shape[0]
    start = np.zeros(n + 1, np.int64)
    for e in range(i.size):
        start[i[e] + 1] += 1
        start[j[e] + 1] += 1
    for k in range(n):
        start[k + 1] += start[k]
    place, edges = start[:-1].copy(), np.empty(2 * i.size, np.int64)
    for e in range(i.size):
        edges[place[i[e]]] = e
        place[i[e]] += 1
        edges[place[j[e]]] = e
        place[j[e]] += 1
    out, known = poses.copy(), known.copy()
    queue, ended = np.empty(n, np.int64), 0
    for k in range(n):
        if known[k]:
            queue[ended] = k
            ended += 1
    begun = 0
    while begun < ended:
        a = queue[begun]
        begun += 1
        for q in range(start[a], start[a + 1]):
            e = edges[q]
            forward = i[e] == a
            b = j[e] if forward else i[e]
            if known[b]:
                continue
            turn, x, y = z[e, 2], z[e, 0], z[e, 1]
            if not forward:  # the inverse of the measurement
                c, s = math.cos(turn), math.sin(turn)
                turn, x, y = -turn, -c * x - s * y, s * x - c * y
            c, s = math.cos(out[a, 2]), math.sin(out[a, 2])
            out[b, 0] = out[a, 0] + c * x - s * y
            out[b, 1] = out[a, 1] + s * x + c * y
            out[b, 2] = out[a, 2] + turn
            known[b] = True
            queue[ended] = b
            ended += 1
    return out, known
