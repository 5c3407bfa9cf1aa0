"""The front end beside KISS-ICP on the same scans in one run: time, and errors of the relations.

    python -m benchmarks.scan_matching ../shared/data/slam [--log intel fr079] [--scans 2000] [--json]

Each places every scan against its own local map; loops are not closed. KISS-ICP (Vizzo et al., RA-L 2023)
knows no odometry: ``ratio`` compares with pilotage without it, ``odometry_ratio`` with pilotage as it is
used. pilotage begins with ranges, KISS-ICP with points that are ready. Its parameters are its own for a range
of 25 m; scans are not deskewed, as no beam has a time. All are warmed up and take turns; the medians are
compared. It is in the extra ``bench`` (MIT).

Exit code 0 where pilotage is at least 5 times as fast on every log, 1 where not or the peer is not installed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.slam_logs import chosen
from pilotage.core.types import FloatArray
from pilotage.evaluation.relations import relation_errors
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum, write_planar_tum
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import track

BAR, RANGE_M, WARM_UP = 5.0, 25.0, 50


def tracked(log: LaserLog, odometry: bool) -> FloatArray:
    """(N, 3) poses by pilotage's front end."""
    return track(log, SlamConfig(max_range_m=RANGE_M, use_odometry=odometry)).poses


def points_of(log: LaserLog) -> list[FloatArray]:
    """Hits (K, 3) of each scan within range, at no height."""
    out = []
    for scan, ranges_m in enumerate(log.ranges_m):
        hit = ranges_m <= RANGE_M
        r, angle = ranges_m[hit], log.angles_rad(scan)[hit]
        out.append(np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(r.size)]))
    return out


def kiss_icp(scans: list[FloatArray]) -> FloatArray:
    """(N, 3) poses by KISS-ICP."""
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    config = KISSConfig()
    config.data.max_range, config.data.deskew = RANGE_M, False
    config.mapping.voxel_size = RANGE_M / 100.0
    odometry, poses = KissICP(config), np.empty((len(scans), 3))
    for k, points in enumerate(scans):
        odometry.register_frame(points, np.zeros(len(points)))
        at = odometry.last_pose
        poses[k] = at[0, 3], at[1, 3], np.arctan2(at[1, 0], at[0, 0])
    return poses


def timed(place: Callable[[int], FloatArray], count: int) -> tuple[float, FloatArray]:
    """Seconds, and poses of so many scans."""
    began = time.perf_counter()
    poses = place(count)
    return time.perf_counter() - began, poses


def error_m(folder: Path, name: str, t_s: FloatArray, poses: FloatArray) -> float:
    """Mean translational error of the relations among the scans."""
    relations = read_relations(folder / f"{name}.relations")
    stamps = t_s + 1e-6 * np.arange(t_s.size) * np.append(False, np.diff(t_s) <= 0.0)
    with tempfile.TemporaryDirectory() as draft:
        path = Path(draft) / "trajectory.tum"
        write_planar_tum(path, stamps, poses)
        return float(relation_errors(read_tum(path), relations).translation_m.mean())


def measured(folder: Path, name: str, scans: int, repeats: int) -> dict[str, float]:
    """Medians of both, and their errors."""
    log = read_laser_log(folder / f"{name}.bag")
    log = chosen(log, np.arange(min(scans, len(log))))
    points = points_of(log)
    ways: tuple[Callable[[int], FloatArray], ...] = (
        lambda count: tracked(chosen(log, np.arange(count)), False),
        lambda count: tracked(chosen(log, np.arange(count)), True),
        lambda count: kiss_icp(points[:count]),
    )
    for way in ways:
        way(WARM_UP)
    turns = [[timed(way, len(log)) for way in ways] for _ in range(repeats)]
    blind_s, led_s, peer_s = (statistics.median(turn[k][0] for turn in turns) for k in range(len(ways)))
    blind_m, led_m, peer_m = (error_m(folder, name, log.t_s, poses) for _, poses in turns[0])
    return {
        "scans": len(log),
        "kiss_icp_ms": 1e3 * peer_s / len(log),
        "ratio": peer_s / blind_s,
        "odometry_ratio": peer_s / led_s,
        "kiss_icp_m": peer_m,
        "pilotage_m": blind_m,
        "odometry_m": led_m,
    }


def main() -> int:
    """Print a line a log."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--log", nargs="+", default=["intel", "fr079"])
    parser.add_argument("--scans", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of lines")
    asked = parser.parse_args()
    try:
        found = {name: measured(asked.folder, name, asked.scans, asked.repeats) for name in asked.log}
    except ImportError as missing:
        print(f"not installed: {missing}; pip install kiss-icp", file=sys.stderr)
        return 1
    if asked.json:
        print(json.dumps(found))
    else:
        for name, row in found.items():
            print(name, ", ".join(f"{key} {value:.3g}" for key, value in row.items()))
    return 0 if all(row["ratio"] >= BAR for row in found.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
