"""Dead reckoning: odometry of a rover whose heading grows uncertain.

The motion model is equation 4.7 of the rover report with the odometer's own direction of travel: move by
``distance`` along the heading turned by ``aside``, then turn by ``turn``. A step of the report's kind has
``aside`` zero.

First order, the covariance is P <- F P F' + G Q G' (equation 4.5). Once the heading is uncertain by some
degrees it is too small. Second order, it is the exact mean square error about the path that was driven: with
a_k a step's move as a complex number along its heading, w_k the heading's error there and v_k its variance,
the sum of steps is off by sum a_k (exp(i w_k) - 1), whose moments are known without linearization.
"""

from __future__ import annotations

import cmath
import math

from pilotage.kernels.arrays import ComplexArray, FloatArray
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


SUMS = 5
"""Over the steps so far: a exp(v/2), a exp(-v/2), a exp(-3v/2), a; and cov(z, theta) at the start."""


@kernel
def predict_second_order(
    pose: FloatArray,
    cov: FloatArray,
    sums: ComplexArray,
    distance: float,
    aside: float,
    turn: float,
    q_distance: float,
    q_turn: float,
) -> None:
    """One step of ``pose`` (3,), ``cov`` (3, 3) and ``sums`` (SUMS,) in place, by exact moments.

    Of the steps j and k, with m the smaller and n the larger variance (errors of the heading add up, so
    cov(w_j, w_k) = m)::

        E[(exp(i w_j) - 1) conj(exp(i w_k) - 1)] = exp(-(n - m)/2) - exp(-n/2) - exp(-m/2) + 1
        E[(exp(i w_j) - 1) (exp(i w_k) - 1)] = exp(-(n + 3m)/2) - exp(-n/2) - exp(-m/2) + 1

    The moves a_k are told along the measured headings. Bias is a part of the error: nothing is taken off the
    mean for it.
    """
    v, c = cov[2, 2], complex(cov[0, 2], cov[1, 2])
    u = cmath.exp(1j * (pose[2] + aside))
    a, shrink = distance * u, math.exp(-0.5 * v)
    # E[|dz|^2] and E[dz dz] hold the position's covariance as two complex moments.
    A, B = cov[0, 0] + cov[1, 1], complex(cov[0, 0] - cov[1, 1], 2.0 * cov[0, 1])
    rest = sums[3] - sums[1]
    before = 1j * sums[4] * shrink
    A += 2.0 * (a.conjugate() * (shrink * (sums[0] - sums[3]) + rest - before)).real
    A += distance * distance * (2.0 - 2.0 * shrink) + q_distance
    B += 2.0 * a * (shrink * (sums[2] - sums[3]) + rest + before)
    B += a * a * (math.exp(-2.0 * v) - 2.0 * shrink + 1.0) + u * u * q_distance * math.exp(-2.0 * v)
    sums[0] += a / shrink
    sums[1] += a * shrink
    sums[2] += a * shrink * shrink * shrink
    sums[3] += a
    c += 1j * a * v * shrink
    cov[0, 0], cov[1, 1] = 0.5 * (A + B.real), 0.5 * (A - B.real)
    cov[0, 1] = cov[1, 0] = 0.5 * B.imag
    cov[0, 2] = cov[2, 0] = c.real
    cov[1, 2] = cov[2, 1] = c.imag
    cov[2, 2] = v + q_turn
    pose[0] += a.real
    pose[1] += a.imag
    pose[2] = wrap(pose[2] + turn)
