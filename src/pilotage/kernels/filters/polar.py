"""A pose told about a landmark: range, bearing, and the direction from the landmark to the robot.

While a landmark is in sight these three are what is known well, well, and hardly at all: a sighting tells the
first two without linearization, a turn of the robot about the landmark changes the third alone, and a step of
odometry moves the first two whatever the third is. So their errors stay normal where those of x, y, theta (a
bow around the landmark, centimetres thin and tens of metres long) and those of the map frame (which tell
the bearing's error along a direction that is itself uncertain) do not. It is the robocentric form of
Castellanos et al. (2007) in polar coordinates, for one known landmark. Fails where the robot stands on it.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.filters.invariant import error_of
from pilotage.kernels.filters.sighting import range_bearing
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

MAX_EVALUATIONS = 60
LEAST_RANGE_M = 0.01


@kernel
def polar_of(pose: FloatArray, mx: float, my: float, out: FloatArray) -> None:
    """Fill ``out`` (3,) = range, bearing, direction of a pose (3,) about the landmark (mx, my)."""
    dx, dy = pose[0] - mx, pose[1] - my
    out[0], out[2] = math.hypot(dx, dy), math.atan2(dy, dx)
    out[1] = wrap(out[2] + math.pi - pose[2])


@kernel
def pose_of(polar: FloatArray, mx: float, my: float, out: FloatArray, G: FloatArray) -> None:
    """Fill ``out`` (3,), the pose x, y, theta of ``polar`` (3,), and its Jacobian G (3, 3)."""
    r, c, s = polar[0], math.cos(polar[2]), math.sin(polar[2])
    out[0], out[1], out[2] = mx + r * c, my + r * s, wrap(polar[2] + math.pi - polar[1])
    G[0, 0], G[0, 1], G[0, 2] = c, 0.0, -r * s
    G[1, 0], G[1, 1], G[1, 2] = s, 0.0, r * c
    G[2, 0], G[2, 1], G[2, 2] = 0.0, -1.0, 1.0


@kernel
def predict_polar(
    polar: FloatArray,
    cov: FloatArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
) -> None:
    """One step of odometry of ``polar`` (3,) and ``cov`` (3, 3) in place.

    ``distance`` along the heading turned by ``aside``, then ``turn``; half of the turn's error is one of the
    direction of travel. The direction's error enters nothing.
    """
    r, gamma = polar[0], math.pi - polar[1] + aside
    c, s = math.cos(gamma), math.sin(gamma)
    along, across = r + distance * c, distance * s
    square = max(along * along + across * across, LEAST_RANGE_M * LEAST_RANGE_M)
    moved, swung = math.sqrt(square), math.atan2(across, along)
    # The range's and the swing's slopes in the range, in gamma and in the distance.
    r_r, s_r = along / moved, -across / square
    r_g, s_g = -r * across / moved, distance * (distance + r * c) / square
    r_d, s_d = (along * c + across * s) / moved, (along * s - across * c) / square
    F, G = np.empty((3, 3)), np.empty((3, 2))
    F[0, 0], F[0, 1], F[0, 2] = r_r, -r_g, 0.0
    F[1, 0], F[1, 1], F[1, 2] = s_r, 1.0 - s_g, 0.0
    F[2, 0], F[2, 1], F[2, 2] = s_r, -s_g, 1.0
    G[0, 0], G[0, 1] = r_d, 0.5 * r_g
    G[1, 0], G[1, 1] = s_d, 0.5 * s_g - 1.0
    G[2, 0], G[2, 1] = s_d, 0.5 * s_g
    FP = F @ cov
    for i in range(3):
        for j in range(i, 3):
            value = FP[i, 0] * F[j, 0] + FP[i, 1] * F[j, 1] + FP[i, 2] * F[j, 2]
            value += q_distance * G[i, 0] * G[j, 0] + q_turn * G[i, 1] * G[j, 1]
            cov[i, j] = cov[j, i] = value
    polar[0], polar[1], polar[2] = moved, wrap(polar[1] + swung - turn), wrap(polar[2] + swung)


@kernel
def sight(
    mean: FloatArray,
    cov: FloatArray,
    about_x: float,
    about_y: float,
    anchored: bool,
    mx: float,
    my: float,
    r: float,
    b: float,
    R: FloatArray,
    gate: float,
) -> float:
    """Update by range and bearing of a landmark unless too unlikely; returns the posterior's least cost.

    ``anchored``, ``mean`` (3,) and ``cov`` (3, 3) are polar about (about_x, about_y); else a pose and the
    covariance of its map frame's error, and become polar if the sighting is taken. Gauss-Newton over polar
    coordinates (the iterated EKF: Bell and Cathey 1993) on the squared misfit to the prediction and to
    the sighting of (mx, my); its least is the sighting's squared Mahalanobis distance. R (2, 2) is diagonal.
    Returns nan where it cannot be computed.
    """
    inverse: FloatArray = np.linalg.inv(cov).astype(np.float64)
    at, trial, pose, prior = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    G, D, J, hessian = np.empty((3, 3)), np.eye(3), np.empty((3, 3)), np.eye(3)
    z, mount, h = np.empty(2), np.zeros(3), np.empty((2, 3))
    step: FloatArray = np.zeros(3)
    if anchored:
        at[:] = mean
    else:
        polar_of(mean, about_x, about_y, at)
    best, share = math.inf, 1.0
    for _ in range(MAX_EVALUATIONS):
        trial[:] = at + share * step
        trial[0] = max(trial[0], LEAST_RANGE_M)
        pose_of(trial, about_x, about_y, pose, G)
        if not range_bearing(pose, mx, my, mount, z, h):
            return math.nan
        if anchored:
            prior[0], prior[1] = trial[0] - mean[0], wrap(trial[1] - mean[1])
            prior[2] = wrap(trial[2] - mean[2])
            J[:, :] = D
        else:
            error_of(pose, mean, prior, D)
            J[:, :] = D @ G
        misfit_r, misfit_b = r - z[0], wrap(b - z[1])
        weighed = inverse @ prior
        cost = prior @ weighed + misfit_r * misfit_r / R[0, 0] + misfit_b * misfit_b / R[1, 1]
        if math.isnan(cost):
            return math.nan
        if cost > best:
            share *= 0.5
            if share < 1e-6:
                break
            continue
        gained, best, share = best - cost, cost, 1.0
        at[:] = trial
        h = h @ G
        hessian[:, :] = J.T @ inverse @ J
        slope = J.T @ weighed
        for i in range(3):
            slope[i] -= h[0, i] * misfit_r / R[0, 0] + h[1, i] * misfit_b / R[1, 1]
            for j in range(3):
                hessian[i, j] += h[0, i] * h[0, j] / R[0, 0] + h[1, i] * h[1, j] / R[1, 1]
        step = -np.linalg.solve(hessian, slope).astype(np.float64)
        if gained < 1e-9 * max(cost, 1e-6):
            break
    if best <= gate:
        mean[0], mean[1], mean[2] = at[0], wrap(at[1]), wrap(at[2])
        posterior = np.linalg.inv(hessian)
        cov[:, :] = 0.5 * (posterior + posterior.T)
    return best


@kernel
def leave(mean: FloatArray, cov: FloatArray, mx: float, my: float) -> None:
    """Tell ``mean`` (3,) and ``cov`` (3, 3), polar about a landmark, as a pose and its map frame's error."""
    polar, G = mean.copy(), np.empty((3, 3))
    pose_of(polar, mx, my, mean, G)
    cov[:, :] = G @ cov @ G.T


@kernel
def polar_moments(
    polar: FloatArray, cov: FloatArray, mx: float, my: float, mean: FloatArray, out: FloatArray
) -> None:
    """Mean (3,) and covariance (3, 3) of x, y, theta where range, bearing and direction are normal; exact.

    By the moments of r exp(i a), with c = cov(r, a) and s2 = var(a): E = exp(i a - s2/2) (r + i c), and
    E[r^2 exp(2 i a)] = exp(2 i a - 2 s2) ((r + 2 i c)^2 + var(r)).
    """
    r, c, s2 = polar[0], cov[0, 2], cov[2, 2]
    turned = cmath.exp(1j * polar[2] - 0.5 * s2)
    z = turned * complex(r, c)
    square = r * r + cov[0, 0] - (z.real * z.real + z.imag * z.imag)
    double = cmath.exp(2j * polar[2] - 2.0 * s2) * (complex(r, 2.0 * c) ** 2 + cov[0, 0]) - z * z
    mean[0], mean[1], mean[2] = mx + z.real, my + z.imag, wrap(polar[2] + math.pi - polar[1])
    out[0, 0], out[1, 1] = 0.5 * (square + double.real), 0.5 * (square - double.real)
    out[0, 1] = out[1, 0] = 0.5 * double.imag
    # Of the heading's error, the direction's less the bearing's.
    with_theta = turned * (complex(c - cov[0, 1], 0.0) + 1j * (s2 - cov[2, 1]) * complex(r, c))
    out[0, 2] = out[2, 0] = with_theta.real
    out[1, 2] = out[2, 1] = with_theta.imag
    out[2, 2] = s2 + cov[1, 1] - 2.0 * cov[1, 2]
