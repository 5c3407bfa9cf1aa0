"""The explorer that finishes: thirty trials of ``romi-explore``, their medians and tails against the bars.

    python benchmarks/romi_explore.py [--trials 30] [--first-seed 500] [--set KEY=VALUE ...]

Prints one line a trial and a table; the numbers in docs/frontier.md come from here.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

import numpy as np

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

BARS = {
    "coverage_reachable": (0.98, 0.95),
    "visited_accuracy": (0.97, 0.94),
    "feature_precision": (0.85, -math.inf),
    "feature_recall": (0.88, -math.inf),
    "free_accuracy": (0.98, -math.inf),
    "real_time_factor": (100.0, -math.inf),
}
"""What the median and the 10th percentile have to reach."""
TOLD = ("duration_s", "path_length_m", "position_rmse_m", "position_max_m", "min_clearance_m", "nees_mean")


def trial(seed: int, overrides: Sequence[str]) -> dict[str, object]:
    """The metrics of one run."""
    mission = load_mission("romi-explore", ["stack.navigator.name=frontier", *overrides], seed)
    return run_mission(mission, save=False).metrics


def main() -> None:
    """Run the trials and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--first-seed", type=int, default=500)
    parser.add_argument("--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE")
    options = parser.parse_args()
    results = []
    for seed in range(options.first_seed, options.first_seed + options.trials):
        result = trial(seed, options.overrides)
        results.append(result)
        numbers = ", ".join(f"{name} {result[name]:.3f}" for name in BARS)
        print(f"seed {seed}: {numbers}; {result['reason']}", flush=True)
    done = sum(bool(result["success"]) for result in results)
    contacts = sum(result["collisions"] != 0 for result in results)
    print(f"\n{done} of {len(results)} ended by themselves without a contact; {contacts} touched a box\n")
    print(f"{'metric':<20} {'median':>9} {'10th pct':>9} {'least':>9} {'greatest':>9}  bars")
    for name in (*BARS, *TOLD):
        values = np.array([result[name] for result in results], dtype=np.float64)
        median, tenth = float(np.median(values)), float(np.percentile(values, 10.0))
        row = f"{name:<20} {median:9.4g} {tenth:9.4g} {values.min():9.4g} {values.max():9.4g}"
        if name in BARS:
            least_median, least_tenth = BARS[name]
            held = median >= least_median and tenth >= least_tenth
            row += f"  {least_median:g}" + (f" / {least_tenth:g}" if least_tenth > 0.0 else "")
            row += " held" if held else " MISSED"
        print(row)


if __name__ == "__main__":
    main()
