"""Which landmarks a sensor of limited reach has in sight along a path."""

from __future__ import annotations

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def sightings_within(
    truth: FloatArray, points: FloatArray, reach: float, step: IntArray, index: IntArray
) -> int:
    """Which landmarks are within reach at each pose: fills (step, index) pairs, returns how many there are.

    Stops at the arrays' length; call again with longer ones where as many come back.
    """
    count = 0
    for t in range(truth.shape[0]):
        for m in range(points.shape[0]):
            dx, dy = points[m, 0] - truth[t, 0], points[m, 1] - truth[t, 1]
            if dx * dx + dy * dy <= reach * reach:
                if count == step.shape[0]:
                    return count
                step[count], index[count] = t, m
                count += 1
    return count
