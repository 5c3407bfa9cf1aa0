"""The median of a scan's ranges."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


@kernel
def median_of_known(values: FloatArray) -> float:
    """Median of those of values (N,) that are numbers; 0 where none is."""
    known = np.empty(values.shape[0])
    count = 0
    for value in values:
        if value == value:
            known[count] = value
            count += 1
    return np.median(known[:count]) if count > 0 else 0.0
