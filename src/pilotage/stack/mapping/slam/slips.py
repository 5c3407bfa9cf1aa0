"""How far the front end may have slipped between two keyframes, scan by scan."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.slips import add_slip
from pilotage.stack.mapping.slam.fit import Fit
from pilotage.stack.mapping.slam.local_matching import PRIOR

BREAK_SLIP = np.diag([0.2, 0.2, 0.3]) ** 2
BLIND_BREAK_SLIP = np.diag([0.5, 0.5, 0.8]) ** 2
HEALED_SLIP = np.diag([0.05, 0.05, 0.02]) ** 2
GUESS_SLIP = np.diag([0.05, 0.05, 0.05]) ** 2
"""Covariances where the track broke, with odometry and without, where it was joined again, and what each
scan adds that hangs by the odometry alone."""


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
        add_slip(
            self._sum,
            self._held,
            fit.start,
            fit.pose,
            fit.hessian,
            fit.weight,
            fit.guess_error,
            fit.by_odometry,
            PRIOR,
        )

    def add(self, covariance: FloatArray) -> None:
        """Take in a slip of another cause."""
        self._sum += covariance

    def taken(self) -> FloatArray:
        """Return what has come together, and begin anew."""
        out = self._sum + self._held @ self._held.T
        self._sum, self._held = np.zeros((3, 3)), np.zeros((3, 3))
        return out
