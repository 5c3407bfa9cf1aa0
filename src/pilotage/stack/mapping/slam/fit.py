"""Where a scan was found to lie."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray


@dataclass(frozen=True, slots=True)
class Fit:
    """Where a scan lies.

    Attributes
    ----------
    value
        Sum of weights of the aligned points over all points, less where it is far from all guesses.
    pose, hessian, start
        (3,), (3, 3) of the alignment, and (3,) where it began.
    rms_m
        Root mean square of the weighted residuals.
    weight
        Sum of the points' weights.
    """

    value: float
    pose: FloatArray
    hessian: FloatArray
    start: FloatArray
    rms_m: float
    weight: float = 0.0
