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
    off
        Distance from the nearest credible guess.
    weight
        Sum of the points' weights.
    guess_error, by_odometry
        Usual error of the most trusted guess, and whether that is the odometry.
    """

    value: float
    pose: FloatArray
    hessian: FloatArray
    start: FloatArray
    rms_m: float
    off: float = 0.0
    weight: float = 0.0
    guess_error: float = 0.0
    by_odometry: bool = False
