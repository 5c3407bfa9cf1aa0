"""The exploration report's figures 5, 6 and 7: its five configurations with one seed, side by side on a page.

The first argument is the seed, the second how long each may take in simulated seconds. Writes ``romi.html``.
"""

import sys
from pathlib import Path

import pilotage as pl
from pilotage.report.sheet.side_by_side import write_side_by_side

SWITCHES = {
    "NoOA-NoSF": (False, False),
    "NoOA-YesSF": (True, False),
    "YesOA-NoSF": (False, True),
    "YesOA-YesSF": (True, True),
}

seed = int(sys.argv[1]) if len(sys.argv) > 1 else 0
limit_s = float(sys.argv[2]) if len(sys.argv) > 2 else 400.0
runs = {}
for name, (fusion, avoidance) in SWITCHES.items():
    choice = {"name": "surround-check", "fusion": fusion, "avoidance": avoidance}
    settings = {"stack.navigator": choice, "run.time_limit_s": limit_s}
    runs[name] = pl.run(pl.load("romi-explore", seed=seed, set=settings), out="runs")
runs["Baseline"] = pl.run(pl.load("romi-baseline", seed=seed), out="runs")
for name, run in runs.items():
    share = 100.0 * float(run.metrics["coverage_visited"])
    print(f"{name:12s} {share:5.1f} % of the cells, {run.metrics['duration_s']:.0f} s, {run.reason}")
page = write_side_by_side({name: run.folder for name, run in runs.items()}, Path("romi.html"))
print(f"page: {page}")
