"""Which cells of a grid a disc covers as it moves along a path."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.geometry.plane import point_segment_distance
from pilotage.kernels.jit import kernel


@kernel
def mark_swept(
    path: FloatArray, radius: float, x0: float, y0: float, cell: float, covered: BoolArray
) -> None:
    """Mark the cells, row 0 at ``y0``, whose middles a disc covers along a polyline (N, 2)."""
    rows, columns = covered.shape
    for i in range(max(1, path.shape[0] - 1)):
        j = min(i + 1, path.shape[0] - 1)
        ax, ay, bx, by = path[i, 0], path[i, 1], path[j, 0], path[j, 1]
        c0 = max(0, math.floor((min(ax, bx) - radius - x0) / cell))
        c1 = min(columns - 1, math.floor((max(ax, bx) + radius - x0) / cell))
        r0 = max(0, math.floor((min(ay, by) - radius - y0) / cell))
        r1 = min(rows - 1, math.floor((max(ay, by) + radius - y0) / cell))
        for row in range(r0, r1 + 1):
            y = y0 + (row + 0.5) * cell
            for column in range(c0, c1 + 1):
                if not covered[row, column]:
                    x = x0 + (column + 0.5) * cell
                    if point_segment_distance(x, y, ax, ay, bx, by) <= radius + 1e-9:
                        covered[row, column] = True
