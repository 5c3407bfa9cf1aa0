"""The rover in Gale Crater over many seeds: ellipses, errors, consistency (the third task's table).

``python -m benchmarks.gale [RUNS]``: RUNS of dead reckoning (300 by default), a third of them of the filter.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.evaluation.rover_metrics import in_ellipse, stretches_without
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

EVERY = 50


@dataclass(frozen=True, slots=True)
class Sample:
    """Over runs: share of steps in the ellipse, final errors, NEES every so often, mean NIS."""

    covered: FloatArray
    final_m: FloatArray
    nees: FloatArray
    nis: FloatArray
    stretches: int


def sample(name: str, runs: int, *overrides: str) -> Sample:
    """The same drive, by the truth and watched, with many seeds."""
    covered, final, consistency, nis, stretches = [], [], [], [], 0
    for seed in range(runs):
        mission = load_mission(name, ["run.oracles=[driver]", *overrides], seed)
        trace = simulate(mission).finished.robots[0].trace
        truth, estimate, covs = poses(trace, "true"), poses(trace, "est"), covariances(trace)
        covered.append(in_ellipse(truth, estimate, covs, 0.95).mean())
        final.append(np.hypot(*(estimate[-1, :2] - truth[-1, :2])))
        consistency.append(nees(truth, estimate, covs))
        if "nis" in trace:
            nis.append(np.nansum(trace["nis"]) / np.nansum(trace["nis_expected"]))
        step_m = np.concatenate([[0.0], np.hypot(*np.diff(truth[:, :2], axis=0).T)])
        seen = np.nan_to_num(trace.get("beacons_seen", np.zeros(len(truth)))).astype(np.int64)
        stretches = len(stretches_without(seen, step_m))
    # The drives differ by nothing, so their lengths may differ by a step at most.
    steps = min(len(series) for series in consistency)
    return Sample(
        np.array(covered),
        np.array(final),
        np.array([series[:steps:EVERY] for series in consistency]),
        np.array(nis),
        stretches,
    )


def main() -> None:
    """Print the table."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    few = max(runs // 3, 10)
    reckoned = {
        order: sample("gale-dead-reckoning", runs, f"stack.localizer.covariance={order}")
        for order in ("second-order", "first-order")
    }
    for order, found in reckoned.items():
        error = found.covered.std() / np.sqrt(runs)
        print(
            f"dead reckoning, {order}: truth in its 95 % ellipse {100 * found.covered.mean():.2f} % of the "
            f"time (+- {100 * error:.2f}, {runs} runs); mean NEES {found.nees.mean():.2f}"
        )
    found = sample("gale-ekf", few)
    low, high = (float(chi2.ppf(share, 3 * few)) / few for share in (0.0005, 0.9995))
    mean = found.nees.mean(axis=0)
    print(
        f"EKF: median error at the end {np.median(found.final_m):.2f} m, dead reckoning "
        f"{np.median(reckoned['second-order'].final_m):.0f} m; "
        f"stretches over 1 km without landmarks: {found.stretches}"
    )
    inside = 100 * ((mean > low) & (mean < high)).mean()
    print(
        f"EKF, {few} runs: mean NEES {found.nees.mean():.3f}, {inside:.1f} "
        f"% of the steps in the pointwise 99.9 % band {low:.2f} to {high:.2f}; "
        f"NIS per degree of freedom {found.nis.mean():.4f}; "
        f"truth in its ellipse {100 * found.covered.mean():.1f} %"
    )


if __name__ == "__main__":
    main()
