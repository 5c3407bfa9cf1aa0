"""How far the front end may have slipped between two keyframes, scan by scan."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between
from pilotage.stack.mapping.slam.local_matching import PRIOR, Fit

SLIP_SHARE, SLIP_M = 0.15, 0.4
"""A match as far as SLIP_M from its guess may be off by as much; a nearer one by that share and less."""
BREAK_SLIP = np.diag([0.2, 0.2, 0.3]) ** 2
BLIND_BREAK_SLIP = np.diag([0.5, 0.5, 0.8]) ** 2
HEALED_SLIP = np.diag([0.05, 0.05, 0.02]) ** 2
GUESS_SLIP = np.diag([0.05, 0.05, 0.05]) ** 2
"""Covariances where the track broke, with odometry and without, where it was joined again, and what each
scan adds that hangs by the odometry alone."""
CHANCE = 0.03
"""Part of the weights of an alignment's points that tells nothing: their lines' directions are not exact, so
that even a bare wall seems to hold a scan along its course."""


class Slips:
    """Covariance (3, 3), in the scanner's frame, of what the front end may have slipped since it was asked.

    Where a scan leaves the pose open, the guess of the motion is all there is, with its usual error: by
    chance from scan to scan where it is the odometry, and the same all along where it is a constant
    velocity.
    """

    def __init__(self) -> None:
        self._sum, self._held = np.zeros((3, 3)), np.zeros((3, 3))

    def matched(self, fit: Fit) -> None:
        """Take in a scan that was aligned."""
        off = between(fit.start, fit.pose)
        far = np.array([float(np.hypot(off[0], off[1])), abs(float(off[2]))])
        position, heading = (SLIP_SHARE * far) ** 2 + (far * far / np.array([SLIP_M, 0.5 * SLIP_M])) ** 2
        self._sum = self._sum + np.diag([position, position, heading])
        c, s = np.cos(fit.pose[2]), np.sin(fit.pose[2])
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        told = told_by(turn.T @ fit.hessian @ turn, fit.weight)
        # Squared: what the map holds, however weakly, does not add up from scan to scan.
        left = np.linalg.matrix_power(np.linalg.solve(told + PRIOR, PRIOR), 2) * fit.guess_error
        if fit.by_odometry:
            self._sum = self._sum + left @ left.T
        else:
            self._held = self._held + left

    def add(self, covariance: FloatArray) -> None:
        """Take in a slip of another cause."""
        self._sum = self._sum + covariance

    def taken(self) -> FloatArray:
        """Return what has come together, and begin anew."""
        out = self._sum + self._held @ self._held.T
        self._sum, self._held = np.zeros((3, 3)), np.zeros((3, 3))
        return out


_EVEN = np.diag([1.0, 1.0, 0.0])


def told_by(hessian: FloatArray, weight: float) -> FloatArray:
    """(3, 3) of an alignment's Hessian what does not come by chance; ``weight``: the sum of its points'."""
    told, axes = np.linalg.eigh(hessian - CHANCE * weight * _EVEN)
    return np.asarray(axes @ np.diag(np.maximum(told, 0.0)) @ axes.T)
