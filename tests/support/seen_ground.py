"""Ground that a robot has seen, with obstacle points on it, as kernels of local control take it."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.control.ground_shown import believed
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.grids.distance import nearest_marked

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
DRIVE = Drive(2.0, 0.5, 3.0, 2.0, 4.0, 6.0)


def ground_of(points: FloatArray, togo: FloatArray | None = None) -> Ground:
    """All seen ground of 8 m about the origin with obstacle points."""
    n = 160
    hits = np.zeros((n, n), dtype=np.uint8)
    mean = np.zeros((n * n, 2))
    for x, y in points:
        row, column = int((y + 4.0) / 0.05), int((x + 4.0) / 0.05)
        hits[row, column] = 5
        mean[row * n + column] = x, y
    half = n // 2
    far = np.full((half, half), 9.0)
    field = np.zeros((half, half)) if togo is None else togo
    _, nearest = nearest_marked(believed(hits) > 0)
    return Ground(hits, mean, nearest, far, field, -4.0, -4.0, 0.05, 0.1, 20.0, 10.0)
