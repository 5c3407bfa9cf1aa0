"""The museum night watch in ten lines: run a mission, print what came out, write its report."""

import pilotage as pl

mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99})
run = pl.run(mission)
print("success:", run.success, "-", run.reason)
print(f"position error: {1e3 * run.metrics['position_rmse_m']:.1f} mm RMSE")
print(f"NEES: {run.metrics['nees_mean']:.2f} (3 is ideal)")
print("report:", run.report())
