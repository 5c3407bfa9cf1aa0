"""How well a localizer did on a recording: errors where the truth is known, consistency, gate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.consistency import longest_outside_s, nees, nees_metrics, nis_metrics
from pilotage.evaluation.driving import covariances, poses
from pilotage.evaluation.pose_errors import pose_errors

LOST_M = 2.0
"""A robot that ends farther than this from where it believes to be is lost."""


def log_metrics(
    trace: Mapping[str, FloatArray], localized: BoolArray, *, told: bool = True
) -> tuple[dict[str, object], FloatArray]:
    """Metrics of a trace at the scored steps, and its (N,) NEES, nan where the truth is not known.

    ``localized`` (N,): whether the localizer held itself for localized. Who was ``told`` no start claims no
    pose before it has found one: errors count from then on.
    A step whose truth is nan (a gap) is left out and counted in ``steps_without_truth``.
    """
    truth, estimate = poses(trace, "true"), poses(trace, "est")
    known = np.isfinite(truth).all(axis=1)
    found = np.maximum.accumulate(localized)
    values = np.full(known.shape[0], np.nan)
    metrics: dict[str, object] = {
        "scored_steps": int(known.sum()),
        "steps_without_truth": int((~known).sum()),
    }
    if not told:
        metrics["lost"] = not localized[-1]
        known &= found
        if found.any():
            metrics["found_after_s"] = float(trace["t_s"][np.argmax(found)] - trace["t_s"][0])
    if known.any():
        values[known] = nees(truth[known], estimate[known], covariances(trace)[known])
        errors = pose_errors(truth[known], estimate[known])
        metrics |= errors.metrics() | nees_metrics(values)
        ellipses = truth[known], estimate[known], covariances(trace)[known]
        metrics["silently_wrong_s"] = longest_outside_s(trace["t_s"][known], *ellipses, localized[known])
        metrics["lost"] = bool(errors.distance_m[-1] > LOST_M)
    return metrics | _gate(trace), values


def _gate(trace: Mapping[str, FloatArray]) -> dict[str, object]:
    """NIS and the accepted share."""
    if "nis" not in trace:
        return {}
    found = nis_metrics(trace["nis"], trace["nis_expected"])
    seen = trace["beacons_seen"].sum() if "beacons_seen" in trace else 0.0
    if seen > 0.0:
        found["accepted_fraction"] = float(trace["beacons_accepted"].sum() / seen)
        found["readings"] = int(seen)
    return found
