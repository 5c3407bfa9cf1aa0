"""How far a disc could drive straight on in each of many directions, by a scan alone."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def free_lengths(points: FloatArray, headings: FloatArray, half_width: float, reach: float) -> FloatArray:
    """Free length (K,) of a lane of ``half_width`` along each heading, at most ``reach``.

    ``points`` (N, 2) are returns in the robot's frame; the lane begins at its centre and ends at the first
    point inside it.
    """
    out = np.full(headings.shape[0], reach)
    for k in range(headings.shape[0]):
        c, s = math.cos(headings[k]), math.sin(headings[k])
        for i in range(points.shape[0]):
            along = points[i, 0] * c + points[i, 1] * s
            if along <= 0.0 or along >= out[k]:
                continue
            if abs(points[i, 1] * c - points[i, 0] * s) < half_width:
                out[k] = along
    return out
