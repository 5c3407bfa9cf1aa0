"""Which obstacle is nearest to each node of a grid, and exact distances by it."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.field import BLOCK
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel

IndexArray = NDArray[np.int32]
Box: TypeAlias = tuple[float, float, float, float]
"""Least and largest x, least and largest y."""
NearestGrid: TypeAlias = tuple[IndexArray, float, float, float, FloatArray]
"""Index (rows, columns) of the item nearest to each node, x and y of node (0, 0), the nodes' spacing, and the
items (N, 5)."""
LEAST = 1e-300
"""In place of a squared length of 0: a segment without one is a point."""
SEVERAL = -1


@kernel
def item_distance(x: float, y: float, items: FloatArray, i: int) -> float:
    """Distance to item i of (N, 5): a segment x0, y0, x1, y1 thickened by a radius; negative inside it."""
    return float(
        point_segment_distance(x, y, items[i, 0], items[i, 1], items[i, 2], items[i, 3]) - items[i, 4]
    )


@kernel
def nearest_items(x0: float, y0: float, resolution: float, nx: int, ny: int, items: FloatArray) -> IndexArray:
    """Index (ny, nx) of the item (N, 5) nearest to each node.

    As in ``field.sample_distance``, items too far from a block of nodes are passed over for all of it.
    """
    out = np.empty((ny, nx), np.int32)
    away = np.empty(items.shape[0])
    near = np.empty(items.shape[0], np.int32)
    for row0 in range(0, ny, BLOCK):
        row1 = min(ny, row0 + BLOCK)
        for col0 in range(0, nx, BLOCK):
            col1 = min(nx, col0 + BLOCK)
            mx = x0 + 0.5 * (col0 + col1 - 1) * resolution
            my = y0 + 0.5 * (row0 + row1 - 1) * resolution
            spread = math.hypot(col1 - col0, row1 - row0) * resolution * (1.0 + 1e-9)
            least = math.inf
            for i in range(items.shape[0]):
                away[i] = item_distance(mx, my, items, i)
                least = min(least, away[i])
            count = 0
            for i in range(items.shape[0]):
                if away[i] <= least + spread:
                    near[count] = i
                    count += 1
            for row in range(row0, row1):
                y = y0 + row * resolution
                for col in range(col0, col1):
                    x = x0 + col * resolution
                    best, which = math.inf, 0
                    for n in range(count):
                        d = item_distance(x, y, items, near[n])
                        if d < best:
                            best, which = d, near[n]
                    out[row, col] = which
    return out


@kernel
def node_of(value: float, begin: float, resolution: float, count: int) -> int:
    """The node of ``count`` along an axis nearest to a coordinate; off the grid the one at its edge."""
    return int(min(max((value - begin) / resolution + 0.5, 0.0), count - 0.5))


@kernel
def item_throughout(
    box: Box, nearest: IndexArray, x0: float, y0: float, resolution: float, most_nodes: int
) -> int:
    """The item that is nearest to the nodes of all points in a box; ``SEVERAL`` where it is not the same.

    Also where that would have to be looked up at more than ``most_nodes`` nodes.
    """
    ny, nx = nearest.shape
    low, high = node_of(box[0], x0, resolution, nx), node_of(box[1], x0, resolution, nx)
    bottom, top = node_of(box[2], y0, resolution, ny), node_of(box[3], y0, resolution, ny)
    if (high - low + 1) * (top - bottom + 1) > most_nodes:
        return SEVERAL
    item = nearest[bottom, low]
    for row in range(bottom, top + 1):
        for col in range(low, high + 1):
            if nearest[row, col] != item:
                return SEVERAL
    return int(item)


@kernel
def distances_to_item(x: FloatArray, y: FloatArray, items: FloatArray, i: int) -> FloatArray:
    """Distances (K,) from points, x (K,) and y (K,), to item i of (N, 5), as of ``distances_by_node``."""
    out = np.empty(x.shape[0])
    ax, ay, radius = items[i, 0], items[i, 1], items[i, 4]
    ex, ey = items[i, 2] - ax, items[i, 3] - ay
    per_length2 = 1.0 / max(ex * ex + ey * ey, LEAST)
    for k in range(x.shape[0]):
        t = min(1.0, max(0.0, ((x[k] - ax) * ex + (y[k] - ay) * ey) * per_length2))
        dx, dy = x[k] - (ax + t * ex), y[k] - (ay + t * ey)
        out[k] = abs(math.sqrt(dx * dx + dy * dy) - radius)
    return out


@kernel
def distances_by_node(
    x: FloatArray,
    y: FloatArray,
    nearest: IndexArray,
    x0: float,
    y0: float,
    resolution: float,
    items: FloatArray,
) -> FloatArray:
    """Distances (K,) from points, x (K,) and y (K,), to that of the items (N, 5) nearest to a point's node.

    ``nearest`` (ny, nx) holds the items. Off the grid the node at its edge counts: a noisy reading of an
    outer wall ends behind it.
    """
    ny, nx = nearest.shape
    of_node = nearest.ravel()
    nodes, out = np.empty(x.shape[0], np.int64), np.empty(x.shape[0])
    # Loops that only compute, without a branch: the processor takes several points at once.
    for k in range(x.shape[0]):
        nodes[k] = node_of(y[k], y0, resolution, ny) * nx + node_of(x[k], x0, resolution, nx)
    for k in range(x.shape[0]):
        i = of_node[nodes[k]]
        ax, ay = items[i, 0], items[i, 1]
        ex, ey = items[i, 2] - ax, items[i, 3] - ay
        length2 = max(ex * ex + ey * ey, LEAST)
        t = min(1.0, max(0.0, ((x[k] - ax) * ex + (y[k] - ay) * ey) / length2))
        dx, dy = x[k] - (ax + t * ex), y[k] - (ay + t * ey)
        out[k] = abs(math.sqrt(dx * dx + dy * dy) - items[i, 4])
    return out
