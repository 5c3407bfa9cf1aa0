"""The pose-graph solver beside GTSAM on the benchmark's graphs: objectives, times and their ratio.

    python -m benchmarks.pose_graphs [--json] [--repeats 5]

Both start from the file's own vertices, in one process, compiled before, and take turns; medians are
compared. Ours includes the ordering, the chordal start values and the search to a relative tolerance of 1e-9;
GTSAM's is Levenberg-Marquardt at its own defaults (1e-5), and once at 1e-12 for the reference objective.

Exit code 0 where every objective is within 1e-6 and every time within 3 times GTSAM's, 1 where not, GTSAM
not being installed included.
"""

from __future__ import annotations

import argparse
import importlib
import json
import statistics
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from pilotage.logs.g2o import read_g2o
from pilotage.models.pose_graph_solver import optimize

GRAPHS = Path(__file__).resolve().parents[2] / "shared" / "data" / "pose_graphs"
NAMES = ("CSAIL", "intel", "manhattan", "city10000")
MOST_ERROR, MOST_RATIO = 1e-6, 3.0


@dataclass(frozen=True, slots=True)
class Row:
    """One graph: objectives, medians in milliseconds, our share of GTSAM's time."""

    graph: str
    poses: int
    edges: int
    ours: float
    theirs: float
    ours_ms: float
    theirs_ms: float
    ratio: float
    passed: bool


def compare(gtsam: Any, name: str, repeats: int) -> Row:
    """Solve one graph with both."""
    path = GRAPHS / f"{name}.g2o"
    graph = read_g2o(path).graph
    factors, values = gtsam.readG2o(str(path), False)
    first = min(values.keys())
    tight = gtsam.noiseModel.Diagonal.Sigmas(np.full(3, 1e-6))
    factors.add(gtsam.PriorFactorPose2(first, values.atPose2(first), tight))
    found = optimize(graph)  # compiles
    ours_ms, theirs_ms = [], []
    for _ in range(repeats):
        begun = time.perf_counter()
        found = optimize(graph)
        ours_ms.append(1e3 * (time.perf_counter() - begun))
        begun = time.perf_counter()
        gtsam.LevenbergMarquardtOptimizer(factors, values, gtsam.LevenbergMarquardtParams()).optimize()
        theirs_ms.append(1e3 * (time.perf_counter() - begun))
    exact = gtsam.LevenbergMarquardtParams()
    exact.setRelativeErrorTol(1e-12)
    reference = factors.error(gtsam.LevenbergMarquardtOptimizer(factors, values, exact).optimize())
    ours, theirs = statistics.median(ours_ms), statistics.median(theirs_ms)
    passed = abs(found.objective - reference) <= MOST_ERROR * reference and ours <= MOST_RATIO * theirs
    return Row(
        name, len(graph), graph.i.size, found.objective, reference, ours, theirs, ours / theirs, passed
    )


def main() -> int:
    """Compare, print, and say by the exit code whether the bars hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()
    try:
        gtsam = importlib.import_module("gtsam")
    except ImportError:
        print("gtsam is not installed: nothing to compare with", file=sys.stderr)
        return 1
    rows = [compare(gtsam, name, asked.repeats) for name in NAMES if (GRAPHS / f"{name}.g2o").exists()]
    if asked.json:
        print(json.dumps([asdict(row) for row in rows]))
    else:
        table = Table("graph", "poses", "edges", "objective", "GTSAM's", "ms", "GTSAM's", "ratio", "")
        for row in rows:
            table.add_row(
                row.graph,
                str(row.poses),
                str(row.edges),
                f"{row.ours:.7f}",
                f"{row.theirs:.7f}",
                f"{row.ours_ms:.1f}",
                f"{row.theirs_ms:.1f}",
                f"{row.ratio:.2f}",
                "pass" if row.passed else "FAIL",
            )
        Console().print(table)
    return 0 if rows and all(row.passed for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
