"""Textbook landmark filters beside ``ekf-gauss-markov`` on the recorded robots of a MRCLAM data set.

    python -m benchmarks.recorded_robots ../shared/data/mrclam/MRCLAM_Dataset6 [--json FILE]

Prints a row for each filter; ``--json`` writes what docs/localization.md quotes. Exit code 0 where
``ekf-gauss-markov`` keeps its bars: nobody ever 2 m off, position RMSE at most 0.13 m on the mean and
0.17 m each, mean NEES from 1.5 to 6 for each.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.experiments.recordings.localize import localize_log

NAIVE = ("stack.localizer.doubt_after=null", "stack.localizer.gate=0.9")
FILTERS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("dead-reckoning", "dead-reckoning", ()),
    ("ekf-landmarks", "ekf-landmarks", ()),
    ("iekf-landmarks", "iekf-landmarks", ()),
    ("ukf-landmarks", "ukf-landmarks", ()),
    ("ekf-augmented", "ekf-augmented", ()),
    ("ekf-landmarks, gate 0.9, no doubt", "ekf-landmarks", NAIVE),
    ("ekf-gauss-markov", "ekf-gauss-markov", ()),
)
LOST_M = 2.0
OURS = "ekf-gauss-markov"


@dataclass(frozen=True)
class Row:
    """One filter over all robots."""

    rmse_m: list[float]
    nees: list[float]
    farthest_m: list[float]
    accepted: list[float]

    def holds(self) -> bool:
        """Whether the bars of issue 3 are kept."""
        near = max(self.rmse_m) <= 0.17 and float(np.mean(self.rmse_m)) <= 0.13
        return near and max(self.farthest_m) < LOST_M and all(1.5 <= value <= 6.0 for value in self.nees)


def measured(folder: Path, out: Path, localizer: str, overrides: Sequence[str]) -> Row:
    """Run one filter over the five robots."""
    row = Row([], [], [], [])
    for robot in range(1, 6):
        found = localize_log(
            folder, out, form="mrclam", robot=robot, localizer=localizer, overrides=overrides
        ).metrics
        for values, name in (
            (row.rmse_m, "position_rmse_m"),
            (row.nees, "nees_mean"),
            (row.farthest_m, "position_max_m"),
            (row.accepted, "accepted_fraction"),
        ):
            values.append(float(str(found.get(name, "nan"))))
    return row


def told(label: str, row: Row) -> dict[str, dict[str, float]]:
    """The values of a row, as docs/make_claims.py takes them."""
    kinds = {"RMSE": row.rmse_m, "NEES": row.nees, "farthest": row.farthest_m, "accepted": row.accepted}
    return {
        f"{label} :: {what}": {
            "value": float(np.mean(values)),
            "smallest": min(values),
            "largest": max(values),
            "n": len(values),
        }
        for what, values in kinds.items()
        if np.isfinite(values).all()
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print("| filter | RMSE of robots 1 to 5 [m] | mean | mean NEES (3 is right) | accepted | beyond 2 m |")
    print("| --- | --- | --- | --- | --- | --- |")
    kept = True
    values: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as out:
        for label, localizer, overrides in FILTERS:
            row = measured(options.folder, Path(out), localizer, overrides)
            values |= told(label, row)
            kept = kept and (localizer != OURS or row.holds())
            rmse, nees = ", ".join(f"{x:.2f}" for x in row.rmse_m), ", ".join(f"{x:.1f}" for x in row.nees)
            share = "-" if np.isnan(row.accepted).all() else f"{100.0 * np.mean(row.accepted):.1f} %"
            lost = sum(x >= LOST_M for x in row.farthest_m)
            print(
                f"| `{label}` | {rmse} | {np.mean(row.rmse_m):.2f} | {nees} | {share} | {lost} |", flush=True
            )
    if options.json is not None:
        options.json.write_text(json.dumps(values), encoding="utf-8")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
