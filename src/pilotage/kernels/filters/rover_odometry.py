"""Dead reckoning: odometry of a rover whose heading grows uncertain.

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

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


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
    """One step of ``pose`` (3,) and ``cov`` (3, 3) in place, linearized: equations 4.5 to 4.8."""
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
