"""Errors of estimated poses: one definition for every world and every source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PoseErrors:
    """Errors of the steps that count, and of the last step.

    Attributes
    ----------
    distance_m, heading_rad
        (K,) distance of the estimated from the true position, and the wrapped heading error.
    final
        (3,) estimate minus truth at the last step, whether it counts or not.
    """

    distance_m: FloatArray
    heading_rad: FloatArray
    final: FloatArray

    def metrics(self) -> dict[str, object]:
        """Root mean squares, worst and final error by JSON key; where no step counts, the last alone."""
        x_m, y_m, theta_rad = (float(value) for value in self.final)
        found: dict[str, object] = {"final_error": {"x_m": x_m, "y_m": y_m, "theta_rad": theta_rad}}
        if self.distance_m.size:
            found["position_rmse_m"] = rms(self.distance_m)
            found["position_max_m"] = float(self.distance_m.max())
            found["heading_rmse_rad"] = rms(self.heading_rad)
        return found


def pose_errors(truth: FloatArray, estimate: FloatArray, counted: BoolArray | None = None) -> PoseErrors:
    """Errors of N >= 1 estimated poses.

    Parameters
    ----------
    truth, estimate
        (N, 3) x, y, theta in one frame.
    counted
        (N,) which steps count; None: all.
    """
    error = estimate - truth
    error[:, 2] = wrap_array_to_pi(error[:, 2])
    chosen = error if counted is None else error[counted]
    return PoseErrors(np.hypot(chosen[:, 0], chosen[:, 1]), chosen[:, 2], error[-1])


def rms(values: FloatArray) -> float:
    """Root mean square of (K,) values, K >= 1."""
    return float(np.sqrt(np.mean(values**2)))
