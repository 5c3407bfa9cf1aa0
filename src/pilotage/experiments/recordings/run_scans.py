"""Our own run folders as laser logs: what the robot scanned, and where its odometry alone would have it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.logs.laser_log import LaserLog
from pilotage.records.reckoning import odometry_increments, reckoned
from pilotage.records.run_data import RunData, read_run

EVEN_RAD = 1e-6
"""How far a beam may lie from its place among equal angles."""


def read_run_scans(folder: Path) -> LaserLog:
    """Read the scans and the odometry of a run; of a team's those of its first robot.

    Raises
    ------
    InputError
        Where the folder is no run's or damaged, no scan was recorded, or its beams are at odd angles.
    """
    data = read_run(folder)
    seen = data.sightings
    scans, beams = seen.ranges_m.shape
    if not scans:
        raise InputError(f"{folder}: expected a run with the scans of a LiDAR, found none")
    steps = np.diff(seen.angles_rad)
    if beams < 2 or not steps[0] > 0.0 or np.abs(steps - steps.mean()).max() > EVEN_RAD:
        raise InputError(f"{folder}: expected two or more beams at equal angles, found others")
    t_s, poses = _odometry(data)
    last = np.append(np.diff(t_s) > 0.0, True)
    said = [f"of {len(data.robots)} robots the scans of '{name}' are taken" for name in data.robots[:1]]
    return LaserLog(
        name=folder.resolve().name,
        t_s=seen.scan_t_s,
        # The records have NaN where nothing was in reach, logs where nothing was measured.
        ranges_m=np.where(np.isnan(seen.ranges_m), np.inf, seen.ranges_m),
        beams=np.full(scans, beams, dtype=np.int64),
        first_angle_rad=np.full(scans, seen.angles_rad[0]),
        angle_step_rad=np.full(scans, steps.mean()),
        range_min_m=0.0,
        range_max_m=float(seen.max_range_m),
        mount=Pose2.from_array(seen.mount),
        upside_down=False,
        odometry_t_s=None if poses is None else t_s[last],
        odometry=None if poses is None else poses[last],
        warnings=tuple(said),
    )


def _odometry(data: RunData) -> tuple[FloatArray, FloatArray | None]:
    """(M,) times and (M, 3) poses by the odometry alone; at the scans, where they are kept with those."""
    at_scans = data.sightings.scan_odometry
    if len(at_scans):
        return at_scans[:, 0], at_scans[:, 1:]
    increments = odometry_increments(data.trace)
    return data.trace.t_s, None if increments is None else reckoned(increments)
