"""How well a localizer did on a recording: errors where the truth is known, consistency, gate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import correlated_mean, nees
from pilotage.evaluation.run_metrics import covariances, poses

LOST_M = 2.0
"""A robot that ends farther than this from where it believes to be is lost."""


def log_metrics(trace: dict[str, FloatArray]) -> dict[str, object]:
    """Metrics of a trace at the scored steps; adds the column ``nees`` to it.

    A step whose truth is nan (a gap) is left out and counted in ``steps_without_truth``.
    """
    truth, estimate = poses(trace, "true"), poses(trace, "est")
    known = np.isfinite(truth).all(axis=1)
    trace["nees"] = np.full(known.shape[0], np.nan)
    metrics: dict[str, object] = {
        "scored_steps": int(known.sum()),
        "steps_without_truth": int((~known).sum()),
    }
    if known.any():
        trace["nees"][known] = nees(truth[known].copy(), estimate[known], covariances(trace)[known])
        error = estimate[known] - truth[known]
        distance = np.hypot(error[:, 0], error[:, 1])
        band = correlated_mean(trace["nees"])
        metrics |= {
            "position_rmse_m": float(np.sqrt(np.mean(distance**2))),
            "position_max_m": float(distance.max()),
            "heading_rmse_rad": float(np.sqrt(np.mean(wrap_array_to_pi(error[:, 2]) ** 2))),
            "final_error": {
                "x_m": float(error[-1, 0]),
                "y_m": float(error[-1, 1]),
                "theta_rad": float(wrap_array_to_pi(error[-1:, 2])[0]),
            },
            "nees_mean": band.mean,
            "nees_low": band.low,
            "nees_high": band.high,
            "lost": bool(distance[-1] > LOST_M),
        }
    return metrics | _gate(trace)


def _gate(trace: Mapping[str, FloatArray]) -> dict[str, object]:
    """NIS per degree of freedom, corrected for what the gate cuts off, and the accepted share."""
    found: dict[str, object] = {}
    if "nis" not in trace:
        return found
    expected = trace["nis_expected"]
    measured = np.isfinite(trace["nis"]) & (expected > 0.0)
    if measured.any():
        nis, expected = trace["nis"][measured], expected[measured]
        ratio = nis.sum() / expected.sum()
        band = correlated_mean(ratio + (nis - ratio * expected) / expected.mean())
        found |= {"nis_mean": band.mean, "nis_low": band.low, "nis_high": band.high}
    seen = trace["beacons_seen"].sum()
    if seen > 0.0:
        found["accepted_fraction"] = float(trace["beacons_accepted"].sum() / seen)
        found["readings"] = int(seen)
    return found
