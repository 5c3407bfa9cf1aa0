"""Dead reckoning and landmark updates over a whole log: odometry of a rover whose heading grows uncertain.

The motion model is equation 4.7 of the rover report with the odometer's own direction of travel: move by
``distance`` along the heading turned by ``aside``, then turn by ``turn``. A step of the report's kind has
``aside`` zero.

First order, the covariance is P <- F P F' + G Q G' (equation 4.5). Once the heading is uncertain by some
degrees it is too small and the mean lies too far out, because E[cos(theta)] = cos(mean) exp(-var / 2).
Second order, mean and covariance are the exact moments of the motion of a pose with normal errors
(characteristic function of the heading), without linearization.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.ekf import (
    OUTCOME_ACCEPTED,
    OUTCOME_GATED,
    OUTCOME_UNKNOWN,
    joseph_update2,
    range_bearing,
)
from pilotage.kernels.jit import kernel
from pilotage.kernels.motion import wrap

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@kernel
def predict_first_order(
    pose: FloatArray,
    cov: FloatArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
) -> None:
    """One step in place, linearized: equations 4.5 to 4.8."""
    direction = pose[2] + aside
    c, s = math.cos(direction), math.sin(direction)
    f0, f1 = -distance * s, distance * c  # F = [1 0 f0; 0 1 f1; 0 0 1]
    p02, p12, p22 = cov[0, 2], cov[1, 2], cov[2, 2]
    cov[0, 0] += 2.0 * f0 * p02 + f0 * f0 * p22 + q_distance * c * c
    cov[0, 1] += f0 * p12 + f1 * p02 + f0 * f1 * p22 + q_distance * c * s
    cov[1, 1] += 2.0 * f1 * p12 + f1 * f1 * p22 + q_distance * s * s
    cov[0, 2], cov[1, 2], cov[2, 2] = p02 + f0 * p22, p12 + f1 * p22, p22 + q_turn
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]
    pose[0] += distance * c
    pose[1] += distance * s
    pose[2] = wrap(pose[2] + turn)


@kernel
def predict_second_order(
    pose: FloatArray,
    cov: FloatArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
) -> complex:
    """One step in place by exact moments; returns by how much the mean stays behind the linearized one.

    With z = x + i y, u = exp(i (theta + aside)), v = var(theta), c = cov(z, theta):
    E[u] = u exp(-v/2), E[dz u] = i c u exp(-v/2), E[dz conj(u)] = -i c conj(u) exp(-v/2),
    var |u| = 1 - exp(-v), E[du du] = u^2 (exp(-2v) - exp(-v)), cov(u, theta) = i v u exp(-v/2).
    """
    v, c = cov[2, 2], complex(cov[0, 2], cov[1, 2])
    u = cmath.exp(1j * (pose[2] + aside))
    shrink = math.exp(-0.5 * v)
    # E[|dz|^2] and E[dz dz] hold the position's covariance as two complex moments.
    A, B = cov[0, 0] + cov[1, 1], complex(cov[0, 0] - cov[1, 1], 2.0 * cov[0, 1])
    A += 2.0 * distance * (-1j * c * u.conjugate() * shrink).real
    A += distance * distance * (1.0 - math.exp(-v)) + q_distance
    B += 2.0 * distance * (1j * c * u * shrink)
    B += u * u * (distance * distance * (math.exp(-2.0 * v) - math.exp(-v)) + q_distance * math.exp(-2.0 * v))
    c += 1j * distance * v * u * shrink
    cov[0, 0], cov[1, 1] = 0.5 * (A + B.real), 0.5 * (A - B.real)
    cov[0, 1] = cov[1, 0] = 0.5 * B.imag
    cov[0, 2] = cov[2, 0] = c.real
    cov[1, 2] = cov[2, 1] = c.imag
    cov[2, 2] = v + q_turn
    step = distance * u * shrink
    pose[0] += step.real
    pose[1] += step.imag
    pose[2] = wrap(pose[2] + turn)
    return distance * u * (1.0 - shrink)


@kernel
def dead_reckon(
    pose: FloatArray,
    cov: FloatArray,
    steps: FloatArray,
    variances: FloatArray,
    second_order: bool,
    poses: FloatArray,
    covs: FloatArray,
) -> None:
    """Run odometry alone over a log.

    Parameters
    ----------
    pose, cov
        (3,) and (3, 3) the initial belief; moved in place.
    steps
        (T, 3) distance, aside, turn of each step as the odometer has them.
    variances
        (T, 2) of distance and turn.
    poses, covs
        (T, 3) and (T, 3, 3) are filled.

    Notes
    -----
    Second order, the mean square of the way that the mean stays behind is added to the covariance that is
    handed out. The mean is the best guess where every turn is as likely to be undone as made; a rover on a
    given path is farther along than that by about as much.
    """
    behind = 0j
    for t in range(steps.shape[0]):
        distance, aside, turn = steps[t, 0], steps[t, 1], steps[t, 2]
        if second_order:
            behind += predict_second_order(pose, cov, distance, aside, turn, variances[t, 0], variances[t, 1])
        else:
            predict_first_order(pose, cov, distance, aside, turn, variances[t, 0], variances[t, 1])
        poses[t] = pose
        covs[t] = cov
        covs[t, 0, 0] += behind.real * behind.real
        covs[t, 0, 1] += behind.real * behind.imag
        covs[t, 1, 0] += behind.real * behind.imag
        covs[t, 1, 1] += behind.imag * behind.imag


REFUSED_IN_A_ROW = 5
INFLATION = 4.0
MAX_ITERATIONS = 30
MAX_HALVINGS = 12
CONVERGED = 1e-9


@kernel
def moved(pose: FloatArray, xi: FloatArray, out: FloatArray, M: FloatArray) -> None:
    """The pose exp(xi) X, xi = (v, w) an error of the map frame told at the pose's own place; M its slope.

    p <- p + V(w) v, theta <- theta + w with V(w) = (exp(i w) - 1) / (i w) as a complex number, and
    M = d(out) / d(xi) (Sola, Deray and Atchuthan 2018, equations 158 to 160).
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
def update_on_group(
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
    moved(pose, xi, at, M)
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
        share, gained, way = 1.0, 0.0, 0.0
        for _ in range(MAX_HALVINGS):
            trial[:] = xi + share * (full - xi)
            moved(pose, trial, at, slope)
            cost = posterior_cost(trial, inverse, at, mx, my, r, b, R)
            if cost <= best:
                gained, best = best - cost, cost
                way = abs(trial[0] - xi[0]) + abs(trial[1] - xi[1]) + abs(trial[2] - xi[2])
                xi[:] = trial
                M[:, :] = slope
                break
            share *= 0.5
        if way < CONVERGED or gained < 1e-9 * best:
            break
    if not best <= gate:
        return best
    moved(pose, xi, at, M)
    if not range_bearing(at, mx, my, mount, z, h):
        return math.nan
    # The error is told at the new place from now on, in the prior already: that way the one turn that no
    # sighting of this landmark tells stays the same direction from sighting to sighting.
    # What is left of the curvature, half the commutator of the correction beside that turn with the turn
    # itself, is noise of this sighting: after a long way without landmarks far more than the sensor's.
    aside = math.hypot(xi[0] + xi[2] * (pose[1] - my), xi[1] - xi[2] * (pose[0] - mx))
    bent = 0.5 * math.sqrt(cov[2, 2]) * aside
    noise = R.copy()
    noise[0, 0] += bent * bent
    noise[1, 1] += bent * bent / (z[0] * z[0])
    carry_covariance(cov, at[0] - pose[0], at[1] - pose[1])
    innovation[:] = 0.0
    joseph_update2(full, cov, h, innovation, noise, math.inf)
    pose[:] = at
    return best


@kernel
def carry_covariance(cov: FloatArray, dx: float, dy: float) -> None:
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
    of variance var(w) J Pvv J' / 4 (Barfoot and Furgale 2014, equation 55). It lies along the way, where the
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


@kernel
def filter_sightings(
    pose: FloatArray,
    cov: FloatArray,
    steps: FloatArray,
    variances: FloatArray,
    second_order: bool,
    first: IntArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    R: FloatArray,
    gate: float,
    poses: FloatArray,
    covs: FloatArray,
    nis: FloatArray,
    outcome: IntArray,
) -> int:
    """Run the filter over a log with landmark sightings; returns how many were used.

    First order is the EKF of the report with its slips mended. Second order, the error is that of the map
    frame, in which odometry moves it exactly: no linearization but that of the sightings.

    Parameters
    ----------
    first
        (T + 1,) the sightings of step t are ``first[t]`` to ``first[t + 1]``.
    ids, ranges, bearings
        (S,) sightings in the order of the steps.
    nis, outcome
        (S,) are filled: squared Mahalanobis distance; accepted, gated or unknown.
    """
    z, innovation, mount, H = np.empty(2), np.empty(2), np.zeros(3), np.empty((2, 3))
    used, refused = 0, 0
    for t in range(steps.shape[0]):
        distance, aside, turn = steps[t, 0], steps[t, 1], steps[t, 2]
        predict_first_order(pose, cov, distance, aside, turn, variances[t, 0], variances[t, 1])
        if second_order:
            add_commutators(cov, variances[t, 1])
        for k in range(first[t], first[t + 1]):
            outcome[k] = OUTCOME_UNKNOWN
            nis[k] = math.nan
            i = np.searchsorted(known_ids, ids[k])
            if i == known_ids.shape[0] or known_ids[i] != ids[k]:
                continue
            mx, my = known_points[i, 0], known_points[i, 1]
            if second_order:
                nis[k] = update_on_group(pose, cov, mx, my, ranges[k], bearings[k], R, gate)
            elif range_bearing(pose, mx, my, mount, z, H):
                innovation[0], innovation[1] = ranges[k] - z[0], wrap(bearings[k] - z[1])
                nis[k] = joseph_update2(pose, cov, H, innovation, R, gate)
            outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
            used += outcome[k]
            refused = 0 if outcome[k] == OUTCOME_ACCEPTED else refused + 1
            if refused == REFUSED_IN_A_ROW:
                # So many true sightings are not all wrong: the filter is, and has to become less sure.
                cov *= INFLATION
                refused = 0
        if second_order:
            moments(pose, cov, poses[t], covs[t])
        else:
            poses[t] = pose
            covs[t] = cov
    return used


@kernel
def sightings_within(
    truth: FloatArray, points: FloatArray, reach: float, step: IntArray, index: IntArray
) -> int:
    """Which landmarks are within reach at each pose: fills (step, index) pairs, returns how many there are.

    Stops at the arrays' length; call again with longer ones where as many come back.
    """
    count = 0
    for t in range(truth.shape[0]):
        for m in range(points.shape[0]):
            dx, dy = points[m, 0] - truth[t, 0], points[m, 1] - truth[t, 1]
            if dx * dx + dy * dy <= reach * reach:
                if count == step.shape[0]:
                    return count
                step[count], index[count] = t, m
                count += 1
    return count
