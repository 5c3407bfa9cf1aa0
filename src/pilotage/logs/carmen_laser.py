"""A CARMEN log as a laser log: its limits, which odometry counts, where the laser is mounted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import Pose2
from pilotage.logs.carmen import CarmenLog, read_carmen
from pilotage.logs.laser_log import LaserLog, RawScan, assemble

CARMEN_RANGE_MIN_M = 0.05
CARMEN_RANGE_MAX_M = 80.0
"""A CARMEN scan of the old form says nothing of its limits; the SICK scanners in use then reach 80 m."""
BESIDE_M, BESIDE_RAD, MOST_BETWEEN = 0.02, 0.02, 0.8
"""How far from the course between two ODOM lines the robot's pose of a scan lies that is the odometry, and of
what share of the scans that is asked."""
LARGEST_MOUNT_SPREAD = 0.02
"""Median deviation, in metres or radians, beyond which two poses of each scan give no mount."""


def read_carmen_scans(path: Path) -> LaserLog:
    """Read a CARMEN log (InputError as ``read_carmen`` has it) as a laser log."""
    return laser_log_of_carmen(read_carmen(path), path.name)


def laser_log_of_carmen(log: CarmenLog, name: str) -> LaserLog:
    """Bring a CARMEN log into this form.

    Odometry is the robot's poses of the scans where these lie on the course of the ODOM lines, or where there
    are none: what a scan carries needs no times to tell where it was taken. In corrected logs they lie
    elsewhere, and the ODOM lines count. The mount is the median pose of the laser relative to the robot.
    """
    carried = _carry_odometry(log)
    scans = [
        RawScan(
            float(log.t_s[k]),
            log.ranges_m[k, : log.beams[k]],
            float(log.first_angle_rad[k]),
            float(log.angle_step_rad[k]),
            CARMEN_RANGE_MIN_M,
            CARMEN_RANGE_MAX_M,
            int(log.readings_before[k]),
            log.robot_poses[k] if carried else None,
        )
        for k in range(log.t_s.size)
    ]
    said = []
    if log.cut_short:
        said.append("the file is cut short: it was read up to its last whole line")
    if log.odometry_t_s.size == 0:
        said.append("no ODOM lines: odometry is what the scans carry")
    return assemble(name, scans, _mount(log, said), False, log.odometry_t_s, log.odometry, said)


def _carry_odometry(log: CarmenLog) -> bool:
    """Whether the scans' robot poses are the odometry: between the ODOM lines around each of them."""
    last = log.odometry.shape[0] - 1
    if last < 0:
        return True
    before = log.odometry[np.clip(log.readings_before - 1, 0, last)]
    after = log.odometry[np.clip(log.readings_before, 0, last)]
    way_m = np.hypot(*(after - before)[:, :2].T)
    to_m = np.hypot(*(log.robot_poses - before)[:, :2].T)
    from_m = np.hypot(*(after - log.robot_poses)[:, :2].T)
    turned = np.abs(wrap_array_to_pi(log.robot_poses[:, 2] - before[:, 2]))
    turned += np.abs(wrap_array_to_pi(after[:, 2] - log.robot_poses[:, 2]))
    way_rad = np.abs(wrap_array_to_pi(after[:, 2] - before[:, 2]))
    between = (to_m + from_m < way_m + BESIDE_M) & (turned < way_rad + BESIDE_RAD)
    return bool(between.mean() > MOST_BETWEEN)


def _mount(log: CarmenLog, said: list[str]) -> Pose2:
    offset = log.laser_poses - log.robot_poses
    c, s = np.cos(log.robot_poses[:, 2]), np.sin(log.robot_poses[:, 2])
    x = c * offset[:, 0] + s * offset[:, 1]
    y = -s * offset[:, 0] + c * offset[:, 1]
    turn = wrap_array_to_pi(offset[:, 2])
    mount = np.array([np.median(x), np.median(y), np.median(turn)])
    # Corrected logs may give the laser's pose in the map and the robot's by odometry.
    spread = np.median(np.abs(np.column_stack([x, y, turn]) - mount), axis=0).max()
    if spread > LARGEST_MOUNT_SPREAD:
        said.append("the scans' laser and robot poses do not belong together: the mount is taken as zero")
        mount[:] = 0.0
    return Pose2(float(mount[0]), float(mount[1]), float(mount[2]))
