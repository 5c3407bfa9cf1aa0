"""One component of the odometry's error: a mean that is linear in the motion, a variance that grows with it.

``error = X beta + noise``, ``Var(noise) = Z q`` with non-negative densities q: Z holds the distance driven
and the angle turned of each step. Both parts are estimated in turn, the mean by weighted least squares,
the densities by maximum likelihood.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.calibration.intervals import LEVEL, Estimate, normal_estimate, variance_estimate
from pilotage.core.types import BoolArray, FloatArray

COLLINEAR = 0.02
"""A column whose part outside the others is smaller than this cannot be told from them."""
ROUNDS = 5


@dataclass(frozen=True, slots=True)
class ErrorModel:
    """What was found; None where the steps do not tell.

    Attributes
    ----------
    mean
        One estimate a column of X.
    density
        One estimate a column of Z.
    residual
        (N,) errors without their mean.
    dof
        Steps less the columns of X that were fitted.
    """

    mean: tuple[Estimate | None, ...]
    density: tuple[Estimate | None, ...]
    residual: FloatArray
    dof: int


def fit_error(error: FloatArray, X: FloatArray, Z: FloatArray) -> ErrorModel:
    """Fit an error (N,) with regressors X (N, k) of its mean and Z (N, m) >= 0 of its variance.

    Columns of X and Z that are zero, or that cannot be told from the columns before them, are left out.
    """
    n = error.shape[0]
    used, spread = independent_columns(X), independent_columns(Z)
    dof = n - int(used.sum())
    if dof < 2 or not spread.any():
        nothing = tuple(None for _ in range(Z.shape[1]))
        return ErrorModel(tuple(None for _ in range(X.shape[1])), nothing, error, max(dof, 0))
    A, V = X[:, used], Z[:, spread]
    variance = np.ones(n)
    densities: list[Estimate] = []
    for _ in range(ROUNDS):
        weight = 1.0 / np.sqrt(variance)
        beta = np.linalg.lstsq(A * weight[:, None], error * weight, rcond=None)[0]
        residual = error - A @ beta
        densities = fit_densities(residual, V, n / dof)
        variance = V @ np.array([density.value for density in densities])
        floor = 1e-12 * float(variance.max()) if variance.max() > 0.0 else 1.0
        variance = np.maximum(variance, floor)
    cov = np.linalg.pinv((A / variance[:, None]).T @ A)
    means = [
        normal_estimate(float(b), math.sqrt(max(c, 0.0)), dof)
        for b, c in zip(beta, np.diag(cov), strict=True)
    ]
    return ErrorModel(_spread_out(means, used), _spread_out(densities, spread), residual, dof)


def fit_densities(residual: FloatArray, Z: FloatArray, correction: float) -> list[Estimate]:
    """Densities q of ``Var = Z q``, multiplied by ``correction`` for the parameters of the mean.

    One column: the mean of residual^2 / z, whose interval is exact. Several: maximum likelihood with
    q >= 0, intervals from Fisher's information (low ends cut at 0).
    """
    if Z.shape[1] == 1:
        seen = Z[:, 0] > 0.0
        q = correction * float(np.mean(residual[seen] ** 2 / Z[seen, 0]))
        return [variance_estimate(q, int(seen.sum()) / correction)]
    seen = Z.sum(axis=1) > 0.0
    r2, Zs = residual[seen] ** 2, Z[seen]
    unit = r2.mean() / Zs.sum(axis=1).mean()
    if not unit > 0.0:
        return [Estimate(0.0, 0.0, 0.0) for _ in range(Z.shape[1])]

    def cost(q: FloatArray) -> tuple[float, FloatArray]:
        v = Zs @ q * unit + 1e-9 * unit * Zs.sum(axis=1)
        return float(np.sum(np.log(v) + r2 / v)), unit * Zs.T @ (1.0 / v - r2 / v**2)

    found = scipy.optimize.minimize(
        cost, np.ones(Z.shape[1]), jac=True, method="L-BFGS-B", bounds=[(0.0, None)] * Z.shape[1]
    )
    q = correction * unit * np.asarray(found.x, dtype=np.float64)
    v = np.maximum(Zs @ q, 1e-12 * float((Zs @ q).max()))
    information = 0.5 * (Zs / v[:, None]).T @ (Zs / v[:, None])
    std = np.sqrt(np.maximum(np.diag(np.linalg.pinv(information)), 0.0))
    z = float(scipy.stats.norm.ppf(0.5 + 0.5 * LEVEL))
    return [
        Estimate(float(a), max(0.0, float(a - z * s)), float(a + z * s)) for a, s in zip(q, std, strict=True)
    ]


def independent_columns(X: FloatArray) -> BoolArray:
    """Which columns of X (N, k) are neither zero nor a combination of the columns before them."""
    kept = np.zeros(X.shape[1], dtype=np.bool_)
    basis = np.zeros((X.shape[0], 0))
    for k in range(X.shape[1]):
        length = float(np.linalg.norm(X[:, k]))
        if length == 0.0:
            continue
        rest = X[:, k] / length
        rest = rest - basis @ (basis.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > COLLINEAR:
            kept[k] = True
            basis = np.column_stack([basis, rest / left])
    return kept


def _spread_out(found: list[Estimate], used: BoolArray) -> tuple[Estimate | None, ...]:
    values = iter(found)
    return tuple(next(values) if taken else None for taken in used)
