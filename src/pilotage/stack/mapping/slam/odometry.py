"""Odometry as the scanner sees it, and which of several guesses of the next motion to trust."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.slam.frames import between, between_all, composed, composed_all
from pilotage.kernels.slam.placing import distance, distinct_readings, guessed_motions, learn_motion
from pilotage.logs.laser_log import LaserLog

_SMOOTHED = 4
"""Scans to either side over which stamps are averaged: loggers write them in bursts."""
STAMP_OFF_S, OTHER_READING_M = 0.1, 0.08
"""A stamp may be off by so much; readings nearer together (a radian as half a metre) are one guess."""
_NONE = np.zeros(3)
NO_OTHERS = np.zeros((0, 3))
"""Nothing else that the odometry may have meant."""


def scanner_odometry(log: LaserLog, used: bool) -> FloatArray | None:
    """(N, 3) poses of the scanner at the scans by the odometry; None without one, or where it never moves."""
    poses = log.odometry_at_scans() if used else None
    if poses is None or not np.any(np.abs(np.diff(poses, axis=0)) > 1e-9):
        return None
    return composed_all(poses, mount_pose(log.mount))


class ScanMotions:
    """Motions of the scanner between scans by the odometry of a log, whose stamps may be off.

    Loggers stamp what they receive, in bursts, and late. The reading at a scan's stamp is the first guess;
    those around it that tell of another place are others. Where a scan turns out to lie at one of them, the
    next motion is counted from there.
    """

    def __init__(self, log: LaserLog, used: bool) -> None:
        at_scans = scanner_odometry(log, used)
        self._at_scans = at_scans
        self._anchor = None if at_scans is None else at_scans[0]
        self._starts: list[int] = [0] * (len(log) + 1)
        self._others = NO_OTHERS
        if at_scans is None or _carried(log) or log.odometry is None or log.odometry_t_s is None:
            return
        starts, self._others = distinct_readings(
            at_scans,
            composed_all(log.odometry, mount_pose(log.mount)),
            np.searchsorted(log.odometry_t_s, log.t_s - STAMP_OFF_S),
            np.searchsorted(log.odometry_t_s, log.t_s + STAMP_OFF_S),
            OTHER_READING_M,
        )
        self._starts = starts.tolist()

    def of(self, scan: int) -> tuple[FloatArray | None, FloatArray]:
        """Motion (3,) by the odometry since the last scan, if any, and what else (M, 3) it may be."""
        if self._at_scans is None or self._anchor is None:
            return None, NO_OTHERS
        step = between(self._anchor, self._at_scans[scan])
        first, end = self._starts[scan : scan + 2]
        return step, NO_OTHERS if first == end else between_all(self._anchor, self._others[first:end])

    def learn(self, scan: int, motion: FloatArray, step: FloatArray | None, others: FloatArray) -> None:
        """Count the next motion from the reading that a match (3,) of this scan was nearest to."""
        if step is None or self._at_scans is None or self._anchor is None:
            return
        if len(others) == 0:
            self._anchor = self._at_scans[scan]
            return
        best = min(others, key=lambda other: distance(other, motion))
        usual = distance(step, motion)
        if usual > OTHER_READING_M and distance(best, motion) < 0.5 * usual:
            self._anchor = composed(self._anchor, best)
        else:
            self._anchor = self._at_scans[scan]


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


class MotionGuess:
    """Guesses of the next relative motion, ordered by how far each was off lately.

    The odometry of some logs lacks the sign of a reverse, that of others is not there at all: none is
    believed before it has shown to be right, and a constant velocity is a guess like any other.

    Attributes
    ----------
    velocity
        (3,) in the scanner's frame, a second.
    least_error, odometry_leads
        Running mean error of the most trusted guess, and whether the odometry was nearest lately.
    """

    def __init__(self) -> None:
        self.velocity = np.zeros(3)
        self._errors = np.array([0.0, 0.001, 0.002])
        self.least_error, self.odometry_leads = 0.0, True

    def guesses(self, step: FloatArray | None, dt_s: float) -> tuple[FloatArray, int]:
        """Return the motions (G, 3), the most trusted first, and how many were about as good as that one."""
        return guessed_motions(
            self._errors, self.velocity, _NONE if step is None else step, step is not None, dt_s
        )

    def learn(self, step: FloatArray | None, motion: FloatArray, dt_s: float) -> None:
        """Take in the motion that the scan told."""
        led = step is not None
        learn_motion(self._errors, self.velocity, step if step is not None else _NONE, led, motion, dt_s)
        errors = self._errors.tolist()
        self.least_error = min(errors)
        self.odometry_leads = errors[0] == self.least_error
