"""The rover in Gale Crater over many seeds: ellipses, errors, consistency (the third task's table).

``python -m benchmarks.gale [RUNS]``: RUNS of dead reckoning (300 by default), a third of them of the filter.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.rover_metrics import in_ellipse, stretches_without
from pilotage.experiments.mission import load_mission
from pilotage.experiments.terrain.estimation import estimate, seen_per_step
from pilotage.experiments.terrain.ground import load_ground
from pilotage.experiments.terrain.motion import drive_to_pose
from pilotage.missions.terrain import TerrainMission

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
    """Estimate the same drive with many seeds."""
    mission = load_mission(name, overrides)
    assert isinstance(mission, TerrainMission)
    ground = load_ground(mission.world.ground)
    motion = drive_to_pose(mission, ground)
    truth = np.column_stack([motion.poses[1:, :2], wrap_array_to_pi(motion.poses[1:, 2])])
    step_m = np.concatenate([[0.0], np.hypot(*np.diff(truth[:, :2], axis=0).T)])
    covered, final, consistency, nis, stretches = [], [], [], [], 0
    for seed in range(runs):
        run = mission.run.model_copy(update={"seed": seed})
        made = estimate(mission.model_copy(update={"run": run}), ground, motion.poses)
        found = made.estimate
        covered.append(in_ellipse(truth, found.poses, found.covs, 0.95).mean())
        final.append(np.hypot(*(found.poses[-1, :2] - truth[-1, :2])))
        consistency.append(nees(truth.copy(), found.poses, found.covs)[::EVERY])
        used = found.outcome == 1
        if used.any():
            nis.append(found.nis[used].mean() / gated_mean(chi_square_quantile(found.gate, 2), 2))
        stretches = len(stretches_without(seen_per_step(made.log), step_m))
    return Sample(np.array(covered), np.array(final), np.array(consistency), np.array(nis), stretches)


def main() -> None:
    """Print the table."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    few = max(runs // 3, 10)
    reckoned = {
        order: sample("gale-dead-reckoning", runs, f"stack.estimator.covariance={order}")
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
