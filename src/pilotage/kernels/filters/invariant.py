"""The error of the map frame: the right-invariant one on SE(2).

X = exp(xi) X^ with xi = (v, w), told at the pose's own place (Barrau and Bonnabel 2017). In these errors
odometry moves the belief exactly, but for what its turns' errors do among one another.
"""

from __future__ import annotations

import cmath

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def error_of(pose: FloatArray, mean: FloatArray, xi: FloatArray, D: FloatArray) -> None:
    """Fill xi (3,) = (v, w), which leads from ``mean`` (3,) to ``pose`` (3,), and D (3, 3), its slope in it.

    v = i w / (exp(i w) - 1) (p - p^) as complex numbers, w the heading's difference (Sola, Deray and
    Atchuthan 2018, equations 158 to 160, solved for v).
    """
    w = wrap(pose[2] - mean[2])
    if abs(w) < 1e-4:
        g, slope = 1.0 - 0.5j * w - w * w / 12.0, -0.5j - w / 6.0
    else:
        e = cmath.exp(1j * w)
        g = 1j * w / (e - 1.0)
        slope = (1j + g * (-1j * e)) / (e - 1.0)
    d = complex(pose[0] - mean[0], pose[1] - mean[1])
    v, bend = g * d, slope * d
    xi[0], xi[1], xi[2] = v.real, v.imag, w
    D[0, 0], D[0, 1], D[0, 2] = g.real, -g.imag, bend.real
    D[1, 0], D[1, 1], D[1, 2] = g.imag, g.real, bend.imag
    D[2, 0], D[2, 1], D[2, 2] = 0.0, 0.0, 1.0


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
