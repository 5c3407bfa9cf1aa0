"""Odometry as the scanner sees it, and which of several guesses of the next motion to trust."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.slam.frames import composed
from pilotage.logs.laser_log import LaserLog

_MEMORY = 0.02
"""Weight of the newest error in the running mean: fifty scans count."""
_SMOOTHED = 4
"""Scans to either side over which stamps are averaged: loggers write them in bursts."""
CREDIBLE = 3.0
"""A guess is credible whose mean error is within this factor of the least."""


def scanner_odometry(log: LaserLog, used: bool) -> FloatArray | None:
    """(N, 3) poses of the scanner at the scans by the odometry; None without one, or where it never moves."""
    poses = log.odometry_at_scans() if used else None
    if poses is None or not np.any(np.abs(np.diff(poses, axis=0)) > 1e-9):
        return None
    mount = mount_pose(log.mount)
    return np.array([composed(pose, mount) for pose in poses])


def mount_pose(mount: Pose2) -> FloatArray:
    """(3,) x, y, heading of the scanner on the robot."""
    return mount.as_array()


def smoothed_times(t_s: FloatArray) -> FloatArray:
    """(N,) times with each one's neighbours averaged in."""
    k = _SMOOTHED
    padded = np.concatenate([np.full(k, t_s[0]), t_s, np.full(k, t_s[-1])]) - t_s[0]
    sums = np.concatenate([[0.0], np.cumsum(padded)])
    return np.asarray((sums[2 * k + 1 :] - sums[: -2 * k - 1]) / (2 * k + 1))


def distance(a: FloatArray, b: FloatArray) -> float:
    """How far two motions (3,) are apart, a radian counting as half a metre."""
    return float(np.hypot(a[0] - b[0], a[1] - b[1])) + 0.5 * abs(float(a[2] - b[2]))


@dataclass(slots=True)
class MotionGuess:
    """Guesses of the next relative motion, ordered by how far each was off lately.

    The odometry of some logs lacks the sign of a reverse, that of others is not there at all: none is
    believed before it has shown to be right, and a constant velocity is a guess like any other.
    """

    errors: FloatArray = field(default_factory=lambda: np.array([0.0, 0.001, 0.002]))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def least_error(self) -> float:
        """Running mean error of the most trusted guess."""
        return float(self.errors.min())

    def guesses(self, step: FloatArray | None, dt_s: float) -> list[FloatArray]:
        """Return the motions (3,), the most trusted first."""
        return [motion for motion, _ in self._by_trust(step, dt_s)]

    def credible(self, step: FloatArray | None, dt_s: float) -> list[FloatArray]:
        """Return those of the guesses that were about as good as the best one lately."""
        most = CREDIBLE * self.least_error + 0.003
        return [motion for motion, error in self._by_trust(step, dt_s) if error <= most]

    def _by_trust(self, step: FloatArray | None, dt_s: float) -> list[tuple[FloatArray, float]]:
        """Motions and their running mean errors, the least one first."""
        same = self.velocity * dt_s if dt_s < 1.5 else np.zeros(3)
        motions = [np.zeros(3) if step is None else step, same, np.zeros(3)]
        order = np.argsort(self.errors, kind="stable").tolist()
        return [(motions[k], float(self.errors[k])) for k in order if k != 0 or step is not None]

    def learn(self, step: FloatArray | None, motion: FloatArray, dt_s: float) -> None:
        """Take in the motion that the scan told."""
        motions = [np.zeros(3) if step is None else step, self.velocity * dt_s, np.zeros(3)]
        for k, guess in enumerate(motions):
            self.errors[k] += _MEMORY * (min(1.0, distance(guess, motion)) - self.errors[k])
        self.velocity = 0.5 * self.velocity + 0.5 * motion / max(dt_s, 0.05)
