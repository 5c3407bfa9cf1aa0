"""Which filter knows best where it is, and which knows how well it knows? Ten seeds of the museum route.

The first argument is another number of seeds.
"""

import sys
from statistics import mean

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

FILTERS = {
    "EKF on beacons": [],
    "UKF on beacons": ["stack.localizer.name=ukf-landmarks"],
    "EKF, the report's rotation noise": ["stack.localizer.odometry.angle_var_rad2_per_rad=0.1334"],
    "EKF that believes its beacons too much": ["stack.localizer.measurement_var_scale=0.1"],
    "dead reckoning, 10 s": ["stack.localizer.name=dead-reckoning", "run.time_limit_s=10"],
}

seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
print(f"{'':40s} {'RMSE [mm]':>10s} {'NEES (3)':>10s} {'NIS (1)':>10s}")
for name, overrides in FILTERS.items():
    runs = [
        run_mission(load_mission("museum-route", overrides, seed), save=False).metrics
        for seed in range(seeds)
    ]

    def average(key: str, runs: list[dict[str, object]] = runs) -> float:
        """Mean of one metric over the seeds; nan where a filter has none."""
        values = [float(str(run[key])) for run in runs if key in run]
        return mean(values) if values else float("nan")

    rmse = 1e3 * average("position_rmse_m")
    print(f"{name:40s} {rmse:10.2f} {average('nees_mean'):10.2f} {average('nis_mean'):10.3f}")
