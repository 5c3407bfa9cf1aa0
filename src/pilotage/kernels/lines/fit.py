"""A straight line through points of a scan: total least squares in normal form, with its covariance."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def fit_line(points: FloatArray, index: IntArray, count: int) -> tuple[float, float]:
    """Distance and angle of the line x cos(alpha) + y sin(alpha) = rho that fits points best.

    The points (N, 2) are ``points[index[:count]]``. Total least squares: least sum of squared perpendicular
    distances, rho >= 0 (Arras & Siegwart 1997, eq. 5-6). Undefined for points in one place.
    """
    mx = my = 0.0
    for k in range(count):
        mx += points[index[k], 0]
        my += points[index[k], 1]
    mx /= count
    my /= count
    sxx = syy = sxy = 0.0
    for k in range(count):
        dx, dy = points[index[k], 0] - mx, points[index[k], 1] - my
        sxx += dx * dx
        syy += dy * dy
        sxy += dx * dy
    alpha = 0.5 * math.atan2(-2.0 * sxy, syy - sxx)
    rho = mx * math.cos(alpha) + my * math.sin(alpha)
    if rho < 0.0:
        rho, alpha = -rho, alpha + math.pi
    return rho, wrap(alpha)


@kernel
def line_covariance(
    points: FloatArray,
    directions: FloatArray,
    index: IntArray,
    count: int,
    alpha: float,
    range_var: float,
    cov: FloatArray,
) -> None:
    """Fill ``cov`` (2, 2), the covariance of (rho, alpha) from ``fit_line``, from the noise of the ranges.

    Beam angles are exact and ranges independent, so cov = var sum J_k J_k' with J_k the derivative of
    (rho, alpha) in range k (first order; Arras & Siegwart 1997, sec. 2.2, for range noise alone).
    """
    # The moments of ``fit_line`` once more: for the few points of a line a call costs more than they do.
    mx = my = 0.0
    for k in range(count):
        mx += points[index[k], 0]
        my += points[index[k], 1]
    mx /= count
    my /= count
    sxx = syy = sxy = 0.0
    for k in range(count):
        dx, dy = points[index[k], 0] - mx, points[index[k], 1] - my
        sxx += dx * dx
        syy += dy * dy
        sxy += dx * dy
    a, b = syy - sxx, -2.0 * sxy
    scale = 1.0 / (a * a + b * b)
    c, s = math.cos(alpha), math.sin(alpha)
    lever = my * c - mx * s
    rr = ra = aa = 0.0
    for k in range(count):
        ux, uy = directions[index[k], 0], directions[index[k], 1]
        dx, dy = points[index[k], 0] - mx, points[index[k], 1] - my
        da = 2.0 * (dy * uy - dx * ux)
        db = -2.0 * (dy * ux + dx * uy)
        d_alpha = 0.5 * (a * db - b * da) * scale
        d_rho = (ux * c + uy * s) / count + lever * d_alpha
        rr += d_rho * d_rho
        ra += d_rho * d_alpha
        aa += d_alpha * d_alpha
    cov[0, 0] = range_var * rr
    cov[0, 1] = cov[1, 0] = range_var * ra
    cov[1, 1] = range_var * aa


@kernel
def is_straight(
    points: FloatArray,
    directions: FloatArray,
    index: IntArray,
    count: int,
    rho: float,
    alpha: float,
    range_var: float,
    z: float,
) -> bool:
    """Whether the residuals of a fit to points (N, 2) seen along ``directions`` (N,) are range noise alone.

    A residual's variance is range_var cos^2 of the angle between beam and normal, so their summed squares
    are a weighted sum of chi-squares: matched to one chi-square by mean and variance (Satterthwaite
    1946), whose quantile at normal score ``z`` is that of Wilson & Hilferty (1931).
    """
    c, s = math.cos(alpha), math.sin(alpha)
    total = mean = square = 0.0
    for k in range(count):
        i = index[k]
        residual = points[i, 0] * c + points[i, 1] * s - rho
        weight = directions[i, 0] * c + directions[i, 1] * s
        total += residual * residual
        mean += weight * weight
        square += weight * weight * weight * weight
    if not square > 0.0:
        return False
    mean, square = range_var * mean, range_var * range_var * square
    dof = mean * mean / square
    spread = 2.0 / (9.0 * dof)
    limit = 1.0 - spread + z * math.sqrt(spread)
    return bool(total <= mean * limit * limit * limit)
