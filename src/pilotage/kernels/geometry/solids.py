"""What is solid, as the kernels are handed it: tuples of arrays, told apart by who may move."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel

Cells: TypeAlias = NDArray[np.uint8]
Tiles: TypeAlias = tuple[Cells, FloatArray, IntArray, IntArray, FloatArray]
"""A grid (``scans.tiles``, ``scans.trace``): jump, outlines, starts, items, frame; empty without a grid."""
Fixed: TypeAlias = tuple[FloatArray, FloatArray, Tiles]
"""What does not move: segments (N, 4), circles (M, 3), and a grid."""
Others: TypeAlias = tuple[FloatArray, FloatArray]
"""Bodies that move: their sides (N, 4) and discs (M, 3). Of these a body's ``own`` rows, (3,): first side,
one past the last, disc or -1, do not count for itself."""
Outline: TypeAlias = tuple[FloatArray, float, float]
"""A body: corners (K, 2), none for a disc; radius around the axle; that of the largest disc inside."""


@kernel
def is_anybody(others: Others) -> bool:
    """Whether any body moves about."""
    return bool(others[0].shape[0] + others[1].shape[0] > 0)


@kernel
def without(others: Others, own: IntArray) -> tuple[Others, Others]:
    """All others but the rows ``own``, in two parts."""
    segments, circles = others
    if own[2] >= 0:
        return (segments, circles[: own[2]]), (segments[:0], circles[own[2] + 1 :])
    return (segments[: own[0]], circles), (segments[own[1] :], circles[:0])
