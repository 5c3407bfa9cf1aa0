"""Whether a filter's NEES over many runs keeps to its band."""

from __future__ import annotations

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray


def fraction_in_band(values: FloatArray, dof: int, probability: float = 0.999) -> float:
    """Share of the steps at which the mean over independent runs lies in its pointwise band.

    At one step the runs are independent, so the sum of their NEES is chi-square with runs x dof degrees
    of freedom, whatever the correlation from step to step (Bar-Shalom et al. 2001, section 5.4.2).

    Parameters
    ----------
    values
        (R, N) one row a run.
    dof
        Degrees of freedom of one value.
    probability
        Of the two-sided band.
    """
    runs = values.shape[0]
    low = chi_square_quantile((1.0 - probability) / 2.0, runs * dof) / runs
    high = chi_square_quantile((1.0 + probability) / 2.0, runs * dof) / runs
    means = values.mean(axis=0)
    return float(np.mean((means >= low) & (means <= high)))
