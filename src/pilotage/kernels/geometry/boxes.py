"""Boxes along the axes: distances to them and beams into them."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def distance_to_boxes(x: float, y: float, boxes: FloatArray) -> float:
    """Distance from a point to the nearest of (K, 4) boxes x0, y0, x1, y1; 0 inside, inf without boxes."""
    nearest = math.inf
    for i in range(boxes.shape[0]):
        dx = max(boxes[i, 0] - x, 0.0, x - boxes[i, 2])
        dy = max(boxes[i, 1] - y, 0.0, y - boxes[i, 3])
        nearest = min(nearest, math.hypot(dx, dy))
    return nearest


@kernel
def beam_range(x: float, y: float, theta: float, boxes: FloatArray, most: float) -> float:
    """Length of a beam up to the first box, ``most`` where it meets none nearer.

    Slabs: the beam is inside a box where it is between both pairs of sides at once. A beam that begins
    inside has length 0.
    """
    ux, uy = math.cos(theta), math.sin(theta)
    best = most
    for i in range(boxes.shape[0]):
        enter, leave = 0.0, best
        for axis in range(2):
            origin, along = (x, ux) if axis == 0 else (y, uy)
            low, high = boxes[i, axis], boxes[i, axis + 2]
            if abs(along) < 1e-12:
                if origin < low or origin > high:
                    leave = -1.0
                continue
            first, second = (low - origin) / along, (high - origin) / along
            enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
        if enter <= leave:
            best = min(best, enter)
    return best


@kernel
def distance_to_lines(x: float, y: float, lines: FloatArray) -> float:
    """Distance from a point to the nearest of (M, 4) line pieces x0, y0, x1, y1; inf without any."""
    nearest = math.inf
    for i in range(lines.shape[0]):
        dx, dy = lines[i, 2] - lines[i, 0], lines[i, 3] - lines[i, 1]
        length2 = dx * dx + dy * dy
        along = 0.0 if length2 == 0.0 else ((x - lines[i, 0]) * dx + (y - lines[i, 1]) * dy) / length2
        along = min(max(along, 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - lines[i, 0] - along * dx, y - lines[i, 1] - along * dy))
    return nearest
