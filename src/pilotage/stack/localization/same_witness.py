"""What scans that err together tell of a pose: in no direction more than one of them."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray

LEAST = 1e-15
"""Of a variance [m^2, rad^2]: all particles may be in one place, as odometry without noise leaves them."""


def widening(prior: FloatArray, posterior: FloatArray, kept: float, given: float, whole: float) -> FloatArray:
    """How a cloud that let in more of a scan than it should is moved apart again.

    A cloud that is wide in one direction lets a scan in whole, to become as narrow as it can be at once. In
    the other directions it knows already what scans like this one tell, and would count each of them anew:
    a heading unsure for want of odometry made a robot sure of where it was beside a wall.

    Parameters
    ----------
    prior, posterior
        (3, 3) covariances before and after the scan.
    kept, whole
        Share of what is known that stays beside a scan; exponent of a scan that is alone.
    given
        Exponent with which it was let in.

    Returns
    -------
    (3, 3) what deviations from the mean are multiplied by.

    In the directions w of the generalized eigenvectors prior and scan are both diagonal: with informations p
    and s (``whole`` of the scan) covariance intersection leaves kept p + (1 - kept) s, and where the scan
    alone tells more than is known, s. To first order: a scan's likelihood is taken for a normal one.
    """
    known, w = scipy.linalg.eigh(*(np.linalg.inv(cov + LEAST * np.eye(3)) for cov in (prior, posterior)))
    scan = np.maximum(1.0 - kept * known, 0.0) * whole / given
    told = np.where(scan > known, scan, kept * known + (1.0 - kept) * scan)
    # w' posterior^-1 w = 1: as informative as it is now; only wider, never narrower.
    wider = 1.0 / np.sqrt(np.minimum(told, 1.0))
    return np.asarray((w * wider) @ np.linalg.inv(w))
