"""The mapper beside its peers on the same recordings in one run: errors of the relations, and time.

    python -m benchmarks.slam_peers [../shared/data/slam] [--log intel fr079] [--json]

``pilotage``: front end, closures, optimization and map. ``kiss-icp`` (Vizzo et al. 2023): scans against its
local map, no odometry, no closures (``scan_matching`` compares the front ends alone). ``rbpf-slam``: MRPT's
particle filter with odometry, where Debian's ``mrpt-apps`` is installed. MRPT's ``graphslam-engine`` ends in
a segmentation fault before it reads a scan (mrpt-apps 2.5.8), so it has no row.

Exit code 0 where no peer is more exact on any recording, 1 where one is. A peer that is not installed is
told; without recordings there is nothing to compare.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

from benchmarks import peer_mrpt
from benchmarks.scan_matching import error_m, kiss_icp, points_of
from pilotage.core.types import FloatArray
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log

Mapped = tuple[float, FloatArray]
OURS = "pilotage"


def by_pilotage(log: LaserLog) -> Mapped:
    """Seconds and (N, 3) poses."""
    began = time.perf_counter()
    poses = map_log(log, SlamConfig()).poses
    return time.perf_counter() - began, poses


def by_kiss_icp(log: LaserLog) -> Mapped:
    """Seconds and (N, 3) poses."""
    points = points_of(log)
    began = time.perf_counter()
    poses = kiss_icp(points)
    return time.perf_counter() - began, poses


def by_rbpf_slam(log: LaserLog) -> Mapped:
    """Seconds and (N, 3) poses."""
    with tempfile.TemporaryDirectory() as folder:
        return peer_mrpt.rbpf_slam(log, Path(folder))


MAPPERS: dict[str, tuple[Callable[[LaserLog], Mapped], Callable[[], bool], str]] = {
    OURS: (by_pilotage, lambda: True, ""),
    "kiss-icp": (by_kiss_icp, lambda: find_spec("kiss_icp") is not None, "pip install kiss-icp"),
    "rbpf-slam": (by_rbpf_slam, peer_mrpt.is_installed, "Debian's package mrpt-apps"),
}


def rows(folder: Path, names: list[str]) -> Iterator[tuple[str, str, dict[str, float] | str]]:
    """Recording, mapper, and its numbers or why there are none."""
    for name in names:
        log = read_laser_log(folder / f"{name}.bag")
        length_s = float(log.t_s.max() - log.t_s.min())
        for mapper, (place, is_there, remedy) in MAPPERS.items():
            if not is_there():
                yield name, mapper, f"not installed ({remedy})"
                continue
            try:
                took_s, poses = place(log)
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                yield name, mapper, f"failed: {error}"
                continue
            yield (
                name,
                mapper,
                {
                    "error_m": error_m(folder, name, log.t_s, poses),
                    "took_s": took_s,
                    "times_real_time": length_s / took_s,
                },
            )


def main() -> int:
    """Print a line a recording and mapper."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, nargs="?", default=Path("../shared/data/slam"))
    parser.add_argument("--log", nargs="+", default=["intel", "fr079"])
    parser.add_argument("--json", action="store_true", help="one JSON object instead of lines")
    asked = parser.parse_args()
    names = [name for name in asked.log if (asked.folder / f"{name}.bag").is_file()]
    if not names:
        print(f"slam_peers: no recordings in {asked.folder}, nothing compared", file=sys.stderr)
        return 0
    found: dict[str, dict[str, float]] = {}
    worse = False
    for name, mapper, row in rows(asked.folder, names):
        if isinstance(row, str):
            print(f"{name} {mapper}: {row}", file=sys.stderr)
            continue
        found[f"{name} {mapper}"] = row
        worse |= row["error_m"] < found[f"{name} {OURS}"]["error_m"]
        if not asked.json:
            print(
                f"{name} {mapper}: {row['error_m']:.4f} m, {row['took_s']:.1f} s, "
                f"{row['times_real_time']:.0f} x real time",
                flush=True,
            )
    if asked.json:
        print(json.dumps(found))
    return int(worse)


if __name__ == "__main__":
    sys.exit(main())
