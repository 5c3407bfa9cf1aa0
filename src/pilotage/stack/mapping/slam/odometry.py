"""Odometry as the scanner sees it."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.slam.frames import composed_all
from pilotage.kernels.slam.placing import distinct_readings
from pilotage.kernels.slam.recorded_motions import OTHER_READING_M
from pilotage.kernels.slam.track import Recording
from pilotage.logs.laser_log import LaserLog

_SMOOTHED = 4
"""Scans to either side over which stamps are averaged: loggers write them in bursts."""
STAMP_OFF_S = 0.1
"""A stamp may be off by so much."""
NO_OTHERS = np.zeros((0, 3))
"""Nothing else that the odometry may have meant."""


def scanner_odometry(log: LaserLog, used: bool) -> FloatArray | None:
    """(N, 3) poses of the scanner at the scans by the odometry; None without one, or where it never moves."""
    poses = log.odometry_at_scans() if used else None
    if poses is None or not np.any(np.abs(np.diff(poses, axis=0)) > 1e-9):
        return None
    return composed_all(poses, mount_pose(log.mount))


def recording_of(log: LaserLog, used: bool) -> Recording:
    """Return the scans of a log with the motions of the scanner between them by its odometry, if ``used``.

    Loggers stamp what they receive, in bursts, and late. The reading at a scan's stamp is the first guess;
    those around it that tell of another place are others.
    """
    at_scans, count = scanner_odometry(log, used), len(log)
    starts, others = np.zeros(count + 1, np.int64), NO_OTHERS
    if not (at_scans is None or _carried(log) or log.odometry is None or log.odometry_t_s is None):
        starts, others = distinct_readings(
            at_scans,
            composed_all(log.odometry, mount_pose(log.mount)),
            np.searchsorted(log.odometry_t_s, log.t_s - STAMP_OFF_S),
            np.searchsorted(log.odometry_t_s, log.t_s + STAMP_OFF_S),
            OTHER_READING_M,
        )
    times = smoothed_times(log.t_s)
    return Recording(
        np.ascontiguousarray(log.ranges_m, np.float64),
        np.ascontiguousarray(log.beams, np.int64),
        np.ascontiguousarray(log.first_angle_rad, np.float64),
        np.ascontiguousarray(log.angle_step_rad, np.float64),
        np.maximum(1e-3, np.diff(times, prepend=times[0])),
        NO_OTHERS if at_scans is None else at_scans,
        starts,
        others,
        np.zeros(3) if at_scans is None else at_scans[0].copy(),
    )


def _carried(log: LaserLog) -> bool:
    """Whether each scan has a reading of its own: what the odometry told then, whatever the stamps."""
    return log.odometry_t_s is not None and np.array_equal(log.odometry_t_s, log.t_s)


def mount_pose(mount: Pose2) -> FloatArray:
    """(3,) x, y, heading of the scanner on the robot."""
    return mount.as_array()


def smoothed_times(t_s: FloatArray) -> FloatArray:
    """(N,) times with each one's neighbours averaged in."""
    k = _SMOOTHED
    padded = np.concatenate([np.full(k, t_s[0]), t_s, np.full(k, t_s[-1])]) - t_s[0]
    sums = np.concatenate([[0.0], np.cumsum(padded)])
    return np.asarray((sums[2 * k + 1 :] - sums[: -2 * k - 1]) / (2 * k + 1))
