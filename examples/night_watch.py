"""The museum night watch in ten lines: run a mission, print what came out, write its report."""

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.report import write_report

mission = load_mission("museum-1", ["stack.localizer.gate=0.99"], seed=7)
result = run_mission(mission)
print("success:", result.success, "-", result.metrics["reason"])
print(f"position error: {1e3 * float(str(result.metrics['position_rmse_m'])):.1f} mm RMSE")
print(f"NEES: {result.metrics['nees_mean']:.2f} (3 is ideal)")
if result.run_dir is not None:
    print("report:", write_report(result.run_dir))
