"""The right-invariant filter on SE(2): the error of a pose is an error of the map frame.

X = exp(xi) X^ with xi = (v, w), told at the pose's own place (Barrau and Bonnabel 2017). In these errors
odometry moves the belief exactly, and what one landmark cannot tell, a turn of the robot about it, is a
straight line; in x, y and theta both are curves.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.filters.ekf import joseph_update2
from pilotage.kernels.filters.sighting import range_bearing
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

MAX_ITERATIONS = 30
MAX_HALVINGS = 12
CONVERGED = 1e-9


@kernel
def retract(pose: FloatArray, xi: FloatArray, out: FloatArray, M: FloatArray) -> None:
    """Fill ``out`` (3,) = exp(xi) X and its slope M (3, 3) = d(out) / d(xi), xi (3,) = (v, w).

    p <- p + V(w) v, theta <- theta + w with V(w) = (exp(i w) - 1) / (i w) as a complex number
    (Sola, Deray and Atchuthan 2018, equations 158 to 160).
    """
    w = xi[2]
    if abs(w) < 1e-4:
        f, slope = 1.0 + 0.5j * w - w * w / 6.0, 0.5j - w / 3.0
    else:
        e = cmath.exp(1j * w)
        f = (e - 1.0) / (1j * w)
        slope = (e - f) / w
    v = complex(xi[0], xi[1])
    step, bend = f * v, slope * v
    out[0], out[1], out[2] = pose[0] + step.real, pose[1] + step.imag, wrap(pose[2] + w)
    M[0, 0], M[0, 1], M[0, 2] = f.real, -f.imag, bend.real
    M[1, 0], M[1, 1], M[1, 2] = f.imag, f.real, bend.imag
    M[2, 0], M[2, 1], M[2, 2] = 0.0, 0.0, 1.0


@kernel
def posterior_cost(
    xi: FloatArray,
    inverse: FloatArray,
    at: FloatArray,
    mx: float,
    my: float,
    r: float,
    b: float,
    R: FloatArray,
) -> float:
    """J = xi' P^-1 xi + (z - h)' R^-1 (z - h): squared misfit to the prediction and to the sighting.

    xi (3,), P^-1 ``inverse`` (3, 3), the pose ``at`` (3,) that xi leads to, R (2, 2) diagonal.
    At its least it is the sighting's squared Mahalanobis distance, for a linear one exactly the innovation's.
    """
    cost = 0.0
    for i in range(3):
        for j in range(3):
            cost += xi[i] * inverse[i, j] * xi[j]
    dx, dy = mx - at[0], my - at[1]
    misfit_r = r - math.sqrt(dx * dx + dy * dy)
    misfit_b = wrap(b - wrap(math.atan2(dy, dx) - at[2]))
    return float(cost + misfit_r * misfit_r / R[0, 0] + misfit_b * misfit_b / R[1, 1])


@kernel
def update_invariant(
    pose: FloatArray, cov: FloatArray, mx: float, my: float, r: float, b: float, R: FloatArray, gate: float
) -> float:
    """Update in place by one range and bearing unless it is too unlikely; returns its squared distance.

    Gauss-Newton on the posterior (the iterated EKF: Bell and Cathey 1993) over errors of the map frame
    (the right-invariant error on SE(2): Barrau and Bonnabel 2017). What one landmark cannot tell is a turn of
    the robot about it: a straight line in these errors, a curve in x and y, along which a filter in x and y
    slides and believes to learn. The gate looks at the posterior's least cost: after a kilometre without
    landmarks the first linearization is too far off to judge by. R is diagonal. Returns nan where it cannot
    be computed.
    """
    inverse: FloatArray = np.linalg.inv(cov).astype(np.float64)
    z, innovation, mount, zero = np.empty(2), np.empty(2), np.zeros(3), np.zeros(3)
    h, H, M = np.empty((2, 3)), np.empty((2, 3)), np.empty((3, 3))
    xi, full, trial, at = np.zeros(3), np.zeros(3), np.zeros(3), pose.copy()
    P, slope = np.empty((3, 3)), np.empty((3, 3))
    retract(pose, xi, at, M)
    best = posterior_cost(xi, inverse, at, mx, my, r, b, R)
    for _ in range(MAX_ITERATIONS):
        if not range_bearing(at, mx, my, mount, z, h):
            return math.nan
        H[:, :] = h @ M
        # The innovation seen from the prediction: z less h, less the slope times the way back.
        innovation[0] = r - z[0] + H[0, 0] * xi[0] + H[0, 1] * xi[1] + H[0, 2] * xi[2]
        innovation[1] = wrap(b - z[1]) + H[1, 0] * xi[0] + H[1, 1] * xi[1] + H[1, 2] * xi[2]
        full[:] = zero
        P[:, :] = cov
        if math.isnan(joseph_update2(full, P, H, innovation, R, math.inf)):
            return math.nan
        share, gained, step = 1.0, 0.0, 0.0
        for _ in range(MAX_HALVINGS):
            trial[:] = xi + share * (full - xi)
            retract(pose, trial, at, slope)
            cost = posterior_cost(trial, inverse, at, mx, my, r, b, R)
            if cost <= best:
                gained, best = best - cost, cost
                step = abs(trial[0] - xi[0]) + abs(trial[1] - xi[1]) + abs(trial[2] - xi[2])
                xi[:] = trial
                M[:, :] = slope
                break
            share *= 0.5
        if step < CONVERGED or gained < 1e-9 * best:
            break
    if not best <= gate:
        return best
    retract(pose, xi, at, M)
    if not range_bearing(at, mx, my, mount, z, h):
        return math.nan
    # The error is told at the new place from now on, in the prior already: that way the one turn that no
    # sighting of this landmark tells stays the same direction from sighting to sighting.
    # What is left of the curvature, half the commutator of the correction beside that turn with the turn
    # itself, is noise of this sighting: after a long way without landmarks far more than the sensor's.
    aside = math.hypot(xi[0] + xi[2] * (pose[1] - my), xi[1] - xi[2] * (pose[0] - mx))
    bent = 0.5 * math.sqrt(cov[2, 2]) * aside
    R_bent = R.copy()
    R_bent[0, 0] += bent * bent
    R_bent[1, 1] += bent * bent / (z[0] * z[0])
    transport_covariance(cov, at[0] - pose[0], at[1] - pose[1])
    innovation[:] = 0.0
    joseph_update2(full, cov, h, innovation, R_bent, math.inf)
    pose[:] = at
    return best


@kernel
def transport_covariance(cov: FloatArray, dx: float, dy: float) -> None:
    """Tell the map frame's error at a place (dx, dy) away, in place: its turn moves that place along.

    (v, w) <- (v + w J d, w), the adjoint of a shift; for a sighted landmark the turn about it is kept.
    """
    f0, f1 = -dy, dx
    p02, p12, p22 = cov[0, 2], cov[1, 2], cov[2, 2]
    cov[0, 0] += 2.0 * f0 * p02 + f0 * f0 * p22
    cov[0, 1] += f0 * p12 + f1 * p02 + f0 * f1 * p22
    cov[1, 1] += 2.0 * f1 * p12 + f1 * f1 * p22
    cov[0, 2], cov[1, 2] = p02 + f0 * p22, p12 + f1 * p22
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]


@kernel
def add_commutators(cov: FloatArray, q_turn: float) -> None:
    """Add to second order what the turns' errors do among one another, in place.

    exp(a) exp(b) = exp(a + b + [a, b] / 2 + ...): a step's turn w and the error v before it give -w J v / 2,
    of variance var(w) J Pvv J' / 4 (Barfoot and Furgale 2014, equation 55). It lies along the path, where the
    odometer is good to decimetres, and is what makes a long error bent rather than straight.
    """
    p00, p01, p11 = cov[0, 0], cov[0, 1], cov[1, 1]
    cov[0, 0] += 0.25 * q_turn * p11
    cov[1, 1] += 0.25 * q_turn * p00
    cov[0, 1] -= 0.25 * q_turn * p01
    cov[1, 0] = cov[0, 1]


@kernel
def moments(pose: FloatArray, cov: FloatArray, mean: FloatArray, out: FloatArray) -> None:
    """Mean and covariance of x, y, theta where the map frame's error is normal, to second order.

    p = p^ + v + w J v / 2: E = J cov(v, w) / 2, and Cov grows by a quarter of
    var(w) J Pvv J' + J c c' J' (Isserlis' theorem).
    """
    c0, c1, w = cov[0, 2], cov[1, 2], cov[2, 2]
    mean[0], mean[1], mean[2] = pose[0] - 0.5 * c1, pose[1] + 0.5 * c0, pose[2]
    out[:, :] = cov
    out[0, 0] += 0.25 * (w * cov[1, 1] + c1 * c1)
    out[1, 1] += 0.25 * (w * cov[0, 0] + c0 * c0)
    out[0, 1] += 0.25 * (-w * cov[0, 1] - c0 * c1)
    out[1, 0] = out[0, 1]
