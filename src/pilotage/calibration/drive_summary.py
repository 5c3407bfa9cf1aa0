"""Drive commands as JSON: pooled, by recording, and whether the recordings agree."""

from __future__ import annotations

from collections.abc import Sequence

import scipy

from pilotage.calibration.drive_commands import DriveCommands
from pilotage.calibration.intervals import Estimate

DISAGREE_P = 0.001
LEAST_WIDTH = 1e-12
"""What was found without any scatter weighs much, not infinitely."""
_HALVES = 2.0 * 1.959964
"""Width of a 95 % interval in standard deviations."""


def drive_summary(
    found: DriveCommands, each: Sequence[tuple[dict[str, object], DriveCommands | None]]
) -> dict[str, object]:
    """Return the answer: estimates, what they rest on, each recording alone, warnings.

    ``each``: the recordings' names (as JSON) and what each of them alone gives, None where too short.
    """
    answer: dict[str, object] = {name: estimate.as_dict() for name, estimate in found.estimates.items()}
    answer["windows"] = found.windows
    answer["readings"] = found.readings
    answer["logs"] = [
        {
            **named,
            "windows": int(rows.windows.shape[0]),
            "readings": int(rows.log_ratio.shape[0]),
            "alone": None if alone is None else {n: e.as_dict() for n, e in alone.estimates.items()},
        }
        for (named, alone), rows in zip(each, found.rows, strict=True)
    ]
    told = [alone for _, alone in each if alone is not None]
    apart = [
        name
        for name in found.estimates
        if name != "delay_s" and _disagree([one.estimates[name] for one in told])
    ]
    answer["warnings"] = (
        [
            f"the recordings differ by more than chance in {', '.join(apart)}: "
            "for another robot expect their spread, not the interval"
        ]
        if apart
        else []
    )
    return answer


def _disagree(estimates: Sequence[Estimate]) -> bool:
    """Cochran's test (Biometrics 1954): the spread of the values against their own intervals."""
    if len(estimates) < 2:
        return False
    weights = [(_HALVES / max(one.high - one.low, LEAST_WIDTH)) ** 2 for one in estimates]
    mean = sum(w * one.value for w, one in zip(weights, estimates, strict=True)) / sum(weights)
    q = sum(w * (one.value - mean) ** 2 for w, one in zip(weights, estimates, strict=True))
    return float(scipy.stats.chi2.sf(q, len(estimates) - 1)) < DISAGREE_P
