"""Least squares on rows whose errors hang together within clusters, and intervals that know it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pilotage.calibration.intervals import Estimate, normal_estimate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class ClusteredFit:
    """Coefficients (P,), their standard deviations (P,) and how many degrees of freedom those have."""

    values: FloatArray
    stds: FloatArray
    dof: float

    def estimate(self, index: int) -> Estimate:
        """One coefficient with its interval."""
        return normal_estimate(float(self.values[index]), float(self.stds[index]), self.dof)


def clustered_least_squares(design: FloatArray, target: FloatArray, clusters: IntArray) -> ClusteredFit:
    """Least squares with the cluster-robust ("sandwich") covariance.

    (X'X)^-1 (sum over clusters of X_g' u_g u_g' X_g) (X'X)^-1, with the usual factor G/(G-1) (N-1)/(N-P)
    for few clusters and Student's distribution with G-1 degrees of freedom: Liang and Zeger, Biometrika
    1986; Cameron and Miller, J. Human Resources 2015. Too narrow with fewer than about ten clusters, or
    where errors hang together longer than a cluster is.

    Parameters
    ----------
    design, target, clusters
        (N, P), (N,) and (N,); rows with the same number in ``clusters`` are of one cluster; two or more.

    Raises
    ------
    InputError
        For a single cluster: nothing tells how far clusters differ.
    """
    rows, columns = design.shape
    values, *_ = np.linalg.lstsq(design, target, rcond=None)
    residual = target - design @ values
    _, member = np.unique(clusters, return_inverse=True)
    groups = int(member.max()) + 1
    if groups < 2:
        raise InputError("expected what was measured to span two minutes or more, found less")
    scores = np.zeros((groups, columns))
    np.add.at(scores, member, design * residual[:, None])
    bread = np.linalg.pinv(design.T @ design)
    factor = groups / (groups - 1) * (rows - 1) / max(rows - columns, 1)
    covariance = factor * bread @ (scores.T @ scores) @ bread
    stds: FloatArray = np.sqrt(np.diag(covariance)).astype(np.float64)
    return ClusteredFit(values.astype(np.float64), stds, float(groups - 1))


def jackknife_std(sums: FloatArray, statistic: Callable[[FloatArray], float]) -> float:
    """Standard deviation of ``statistic(sums.sum(axis=0))``, leaving out each cluster of ``sums`` (G, ...).

    Efron and Stein, Ann. Statist. 1981.
    """
    total = sums.sum(axis=0)
    left = np.array([statistic(total - one) for one in sums])
    groups = left.shape[0]
    return float(np.sqrt((groups - 1) / groups * np.sum((left - left.mean()) ** 2)))
