"""A map from a recording's first half, its second half localized in it, judged by relations.

    python -m benchmarks.localize_other_half intel.bag intel.relations

Beside the localizer's error over the relations whose moments it has, that of the odometry over the same ones.
The localizer is told where its half begins by the last pose of the map's half. What of the building only the
second half has seen is on no map.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import pilotage as pl
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.relations import relation_errors
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import Trajectory3, read_tum, write_planar_tum
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log


def first_scans(log: LaserLog, count: int) -> LaserLog:
    """A log's first scans, with all of its odometry."""
    return replace(
        log,
        t_s=log.t_s[:count],
        ranges_m=log.ranges_m[:count],
        beams=log.beams[:count],
        first_angle_rad=log.first_angle_rad[:count],
        angle_step_rad=log.angle_step_rad[:count],
        told_angles=None if log.told_angles is None else log.told_angles[:count],
    )


def written(folder: Path, name: str, t_s: FloatArray, poses: FloatArray) -> Trajectory3:
    """Planar poses as a path in space."""
    write_planar_tum(folder / name, t_s, poses)
    return read_tum(folder / name)


def main() -> None:
    """Print one line a measure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bag", type=Path)
    parser.add_argument("relations", type=Path)
    asked = parser.parse_args()
    log = read_laser_log(asked.bag)
    middle = len(log) // 2
    result = map_log(first_scans(log, middle + 1), SlamConfig(), lambda *_: None)
    start = Pose2.from_array(result.poses[-1]).compose(log.mount.inverse())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_ros_map(folder / "map.yaml", RosMap.of(result.grid, "map.pgm"))
        run = pl.localize(
            asked.bag,
            map=folder / "map.yaml",
            start=start.as_array(),
            from_s=float(log.t_s[middle] - log.t_s[0]),
            out=folder,
        )
        relations = read_relations(asked.relations)
        path = read_tum(run.folder / "trajectory.tum")
        localized = relation_errors(path, relations)
        odometry = log.odometry_at_scans()
        assert odometry is not None, "the benchmark's logs have odometry"
        rows = np.flatnonzero(np.isin(np.round(log.t_s, 6), np.round(path.t_s, 6)))  # type: ignore[arg-type]
        reckoned = relation_errors(written(folder, "o.tum", log.t_s[rows], odometry[rows]), relations)
        print(f"scans per second {run.metrics['steps_per_s']:.0f}")
        print(f"held itself for localized {100.0 * run.metrics['localized_share']:.1f} % of the time")
        for what, errors in (("localized", localized), ("odometry alone", reckoned)):
            found = errors.summary()
            print(
                f"{what}: {found['relations']} relations, {found['trans_mean_m']:.3f} m (median "
                f"{np.median(errors.translation_m):.3f}), {found['rot_mean_deg']:.2f} deg"
            )


if __name__ == "__main__":
    main()
