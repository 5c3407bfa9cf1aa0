"""The mapper on recorded buildings, as they are and damaged: errors of the relations, NEES and speed.

    python -m benchmarks.slam_logs ../shared/data/slam --log intel --damage none zero-odometry jitter [--json]

Each FOLDER/NAME.bag goes with NAME.relations. Damages: ``zero-odometry`` (its poses are all zero), ``jitter``
(the stamp of each scan moved by a normal error of 50 ms, the messages in the order they were recorded),
``jitter-sorted`` (the same, but the order of the file is lost: scans in that of the moved stamps),
``drop-scans`` (every tenth) and ``drop-beams`` (30 %). A trajectory is judged at the true stamps.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.evaluation.relations import relation_errors, relation_nees
from pilotage.logs.laser_log import LaserLog, RawScan, assemble
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum, write_planar_tum
from pilotage.stack.mapping.slam.closures import Verdict
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log

DAMAGES = ("none", "zero-odometry", "jitter", "jitter-sorted", "drop-scans", "drop-beams")
JITTER_S, DROPPED_BEAMS = 0.05, 0.3


def chosen(log: LaserLog, which: IntArray | BoolArray) -> LaserLog:
    """Some of the scans, in another order."""
    return replace(
        log,
        t_s=log.t_s[which],
        ranges_m=log.ranges_m[which],
        beams=log.beams[which],
        first_angle_rad=log.first_angle_rad[which],
        angle_step_rad=log.angle_step_rad[which],
        told_angles=None if log.told_angles is None else log.told_angles[which],
    )


def recorded(log: LaserLog, told_s: FloatArray) -> LaserLog:
    """The log as it is read where its scans have other stamps (N,) in the same order of the file."""
    times_s = np.zeros(0) if log.odometry_t_s is None else log.odometry_t_s
    odometry = np.zeros((0, 3)) if log.odometry is None else log.odometry
    before = np.searchsorted(times_s, log.t_s, side="right")
    scans = [
        RawScan(
            float(told_s[k]),
            log.ranges_m[k, : log.beams[k]],
            float(log.first_angle_rad[k]),
            float(log.angle_step_rad[k]),
            log.range_min_m,
            log.range_max_m,
            int(before[k]),
        )
        for k in range(len(log))
    ]
    return assemble(log.name, scans, log.mount, False, times_s, odometry, log.warnings)


def damaged(log: LaserLog, damage: str, seed: int) -> tuple[LaserLog, FloatArray]:
    """A damaged recording, and the true times of its scans."""
    rng = np.random.default_rng(seed)
    if damage == "zero-odometry" and log.odometry is not None:
        return replace(log, odometry=np.zeros_like(log.odometry)), log.t_s
    if damage in ("jitter", "jitter-sorted"):
        told = log.t_s + JITTER_S * rng.standard_normal(len(log))
        if damage == "jitter":
            return recorded(log, told), np.sort(log.t_s)[np.argsort(told, kind="stable")]
        order = np.argsort(told, kind="stable")
        return replace(chosen(log, order), t_s=told[order]), log.t_s[order]
    if damage == "drop-scans":
        kept = np.arange(len(log)) % 10 != 9
        return chosen(log, kept), log.t_s[kept]
    if damage == "drop-beams":
        ranges = np.where(rng.random(log.ranges_m.shape) < DROPPED_BEAMS, np.nan, log.ranges_m)
        return replace(log, ranges_m=ranges), log.t_s
    return log, log.t_s


def measured(folder: Path, name: str, damage: str, seed: int) -> tuple[str, dict[str, float]]:
    """One line of numbers, and those of it that docs/slam.md quotes."""
    log, true_s = damaged(read_laser_log(folder / f"{name}.bag"), damage, seed)
    began = time.perf_counter()
    result = map_log(log, SlamConfig())
    took_s = time.perf_counter() - began
    order = np.argsort(true_s, kind="stable")
    # Two scans of one stamp keep theirs apart, as ``trajectory.tum`` has it.
    stamps = true_s[order] + 1e-6 * np.arange(order.size) * np.append(False, np.diff(true_s[order]) <= 0.0)
    with tempfile.TemporaryDirectory() as draft:
        path = Path(draft) / "trajectory.tum"
        write_planar_tum(path, stamps, result.poses[order])
        errors = relation_errors(read_tum(path), read_relations(folder / f"{name}.relations"))
    found = errors.summary()
    nees = relation_nees(errors, result.known.relative(order[errors.first], order[errors.second]))
    accepted = sum(closure.verdict is Verdict.ACCEPTED for closure in result.closures)
    line = (
        f"{name} {damage}: {found['trans_mean_m']:.4f} m (most {found['trans_max_m']:.2f}), "
        f"{found['rot_mean_deg']:.2f} deg, NEES {nees.mean():.2f} (median {np.median(nees):.2f}), "
        f"{accepted} of {len(result.closures)} closures, {result.lost} scans lost, "
        f"{(true_s.max() - true_s.min()) / took_s:.0f} x real time; {'; '.join(result.warnings)}"
    )
    return line, {"error_m": float(found["trans_mean_m"] or 0.0), "nees": float(nees.mean())}


def main() -> None:
    """Print a line a building and damage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--log", nargs="+", default=["intel", "fr079"])
    parser.add_argument("--damage", nargs="+", choices=DAMAGES, default=list(DAMAGES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of lines")
    asked = parser.parse_args()
    values = {}
    for name in asked.log:
        for damage in asked.damage:
            line, values[f"{name} {damage}"] = measured(asked.folder, name, damage, asked.seed)
            if not asked.json:
                print(line, flush=True)
    if asked.json:
        print(json.dumps(values))


if __name__ == "__main__":
    main()
