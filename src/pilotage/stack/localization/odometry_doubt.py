"""Odometry that other sensors contradict: how far it is not believed for the next readings."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray
from pilotage.stack.localization.odometry_watch import TURN_AS_PATH_M

IN_A_ROW = 3
"""So many readings are looked at together."""
CHANCE = 0.999
"""Corrections of one, two or three whose squared Mahalanobis lengths add up to what is less likely than that
are no chance."""
FADES = 0.5
"""Share of the doubt that is left after a reading that speaks for the odometry."""
NEXT_TO_NOTHING = 0.1
"""A doubt smaller than this share of the belief's own variances is none."""
LASTING_S = 3.0
"""Who contradicts the odometry for longer may be wrong about where the readings are from, or when."""
UNFIT = 10
"""After so many readings in a row that do not fit it is the place that is wrong, not the odometry."""
SPILLS = 0.1
"""Standard deviation of each coordinate over that of the whole, at least,"""
AS_PATH = np.array([1.0, 1.0, TURN_AS_PATH_M])
"""in metres of path."""


class OdometryDoubt:
    """Variances that a belief gains for each reading while readings move it farther than it can be off.

    Wheels that slip, increments stamped late, or a drive that tells no sign err by what no data sheet has;
    the next increments err alike. The corrections themselves tell by how much: innovation-based adaptive
    estimation (Mehra 1972), begun by a contradiction only. Consistent odometry changes nothing.
    """

    def __init__(self) -> None:
        self._var = np.zeros(3)  # ahead, aside, turn
        self._lengths: deque[float] = deque(maxlen=IN_A_ROW)
        self._longest = np.array([chi_square_quantile(CHANCE, 3 * k) for k in range(1, IN_A_ROW + 1)])
        self._unfit, self._since_s, self._spent = 0, math.inf, False

    @property
    def stds(self) -> FloatArray | None:
        """(3,) ahead, aside and turn, since the last reading told of; None without doubt, or once spent."""
        return np.sqrt(self._var) if self._var.any() and not self._spent else None

    def spend(self) -> None:
        """The belief was widened: who takes in no more readings, as one that stands, does not widen on."""
        self._spent = True

    def forget(self) -> None:
        """The belief begins anew."""
        self._var, self._unfit = np.zeros(3), 0
        self._lengths.clear()

    def judge(self, t_s: float, fits: bool) -> bool:
        """Whether the readings, once they have moved the belief, fit as well as usual.

        Returns
        -------
        Whether the doubt has lasted for too long to believe the readings instead.
        """
        self._unfit = 0 if fits else self._unfit + 1
        if self._unfit >= UNFIT:
            self._var = np.zeros(3)
        return bool(self._var.any()) and t_s - self._since_s > LASTING_S

    def tell(
        self,
        t_s: float,
        prior: tuple[FloatArray, FloatArray],
        mean: FloatArray,
        moved_m: float,
        turned_rad: float,
    ) -> None:
        """A reading moved the mean (3,) and covariance (3, 3) before it, to which so much path and so much
        turning led since the one before, to ``mean`` (3,)."""
        self._spent = False
        if self._unfit >= UNFIT:
            return
        step = mean - prior[0]
        step[2] = wrap_to_pi(float(step[2]))
        if not self._var.any():
            self._lengths.appendleft(float(step @ np.linalg.solve(prior[1], step)))
            sums = np.cumsum(self._lengths)
            if (sums < self._longest[: len(sums)]).all():
                return
            self._lengths.clear()
            self._since_s = t_s
            # A cloud far too narrow follows by a part of the way at most; what was claimed may all be wrong.
            self._var = np.array([moved_m**2, 0.0, turned_rad**2])
        c, s = np.cos(prior[0][2]), np.sin(prior[0][2])
        own = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        expected = np.maximum(np.diag(own @ prior[1] @ own.T) - self._var, 0.0)
        self._var = np.maximum(FADES * self._var, (own @ step) ** 2 - expected)
        # What gives way to a correction along one direction errs in the others too.
        self._var = np.maximum(self._var, SPILLS**2 * float(self._var @ AS_PATH**2) / AS_PATH**2)
        if (self._var < NEXT_TO_NOTHING * expected).all():
            self._var = np.zeros(3)
