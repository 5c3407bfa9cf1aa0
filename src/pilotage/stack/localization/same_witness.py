"""What scans that err together tell of a pose: in no direction more than one of them."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray

LEAST = 1e-15
"""Of a variance [m^2, rad^2]: all particles may be in one place, as odometry without noise leaves them."""
FORGETS = 2.0
"""Of what is known beyond what scans tell, so often what one tells is given up for it at most."""


class SameWitness:
    """Moves a cloud apart where scans told it again what they had told before.

    Scans a path d apart, alike by rho = exp(-d / L), count 1 - rho each: the mean follows them over L. With
    information p known before and u told by scans here, covariance intersection would leave
    rho p + (1 - rho) u, as if nobody knew how much of both is the same (Julier and Uhlmann 1997): after L no
    more than u. But where u is next to nothing, as along a corridor, it forgot so what was learned at the
    corridor's end and what wheels tell since. So much is left instead:

        p + (1 - rho) (max(u - rho p, 0) - rho min(max(p - u, 0), FORGETS u))

    which is covariance intersection where u is a third of p or more, p where u is nothing, and p + u where
    the scans have nothing in common. u is a mean over L: a single scan tells by chance more or less.
    """

    def __init__(self) -> None:
        self._usual: FloatArray | None = None

    def forget(self) -> None:
        """Begin anew: what scans told was told elsewhere."""
        self._usual = None

    def widening(self, prior: FloatArray, posterior: FloatArray, alike: float, given: float) -> FloatArray:
        """How a cloud that let in a scan is moved apart again.

        Parameters
        ----------
        prior, posterior
            (3, 3) covariances before and after the scan.
        alike
            How much the scan's error is the last one's, from 0 to 1.
        given
            With which share of its weight the scan was let in. With more than 1 - ``alike`` a cloud that is
            wide is narrowed at once: where the scan alone tells more than is known, to what it tells.

        Returns
        -------
        (3, 3) what deviations from the mean are multiplied by; never nearer to it.

        In the directions w of the generalized eigenvectors prior and scan are both diagonal, and
        w' posterior^-1 w is one. To first order: a scan's likelihood is taken for a normal one.
        """
        before, after = (np.linalg.inv(cov + LEAST * np.eye(3)) for cov in (prior, posterior))
        known, w = scipy.linalg.eigh(before, after)
        known = np.maximum(known, LEAST)
        told = (1.0 - known) / given
        back = np.linalg.inv(w)
        scan = back.T @ (told[:, None] * back)
        self._usual = scan if self._usual is None else alike * self._usual + (1.0 - alike) * scan
        usual = np.maximum(np.einsum("ki,kl,li->i", w, self._usual, w), 0.0)
        gained = np.maximum(usual - alike * known, 0.0)
        given_up = alike * np.minimum(np.maximum(known - usual, 0.0), FORGETS * usual)
        left = known + (1.0 - alike) * (gained - given_up)
        if given > 1.0 - alike + 1e-9:
            left = np.where(told > known, told, left)
        return np.asarray((w / np.sqrt(np.minimum(left, 1.0))) @ back)
