"""Which places a robot came to, one after the other, and when."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray


def visited_in_order(xy_m: FloatArray, places_m: FloatArray, tolerances_m: Sequence[float]) -> list[int]:
    """The first step at each of the places (P, 2), each after the one before; shorter where one was missed.

    Parameters
    ----------
    xy_m
        (N, 2) true positions.
    tolerances_m
        How near to each place counts.
    """
    steps: list[int] = []
    for place, tolerance_m in zip(places_m, tolerances_m, strict=True):
        begin = steps[-1] if steps else 0
        near = np.flatnonzero(np.hypot(*(xy_m[begin:] - place).T) <= tolerance_m)
        if not near.size:
            break
        steps.append(begin + int(near[0]))
    return steps
