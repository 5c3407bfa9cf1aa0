"""Where dead reckoning may be: a region bent by the heading's error.

The truth is off the sum of the measured moves a_k by z0 + noise + sum a_k (exp(i w_k) - 1), z0 the error at
the start and w_k the heading's, a random walk. Along the greatest axis u of its covariance the error is one
normal number x of unit variance; with c_k = cov(w_k, x) the heading's error is x c_k and a rest w'_k,
independent of x. To second order the truth lies, x given, normally about a parabola, across u::

    mean(x) = x sigma u - x^2 sum a_k c_k^2 / 2 +- sum a_k E[w'_k^2] / 2
    var(x)  = that of sum a_k (i (1 + i x c_k) w'_k + w'_k^2 / 2) and of the noise, across u

so that x^2 and the rest's square over var(x) sum to a chi-square of two degrees of freedom, whatever the
probability. What x turned is undone by turning the measured moves back. The rest shortens a path: the
measured one where the driven one was laid out, the driven one where the robot steered by what it measured.
Nobody tells which, so that the last term's square is a part of var(x) (decision 0241).

It fails where the heading's error is no small angle (beyond some 0.3 rad), and holds too much, by a
hundredth, where the path is straight for 8 km: the rest's squares across u are skewed, and taken as normal.
The path is kept as ``KNOTS`` stretches at most; two become one when there are more.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from pilotage.kernels.arrays import ComplexArray, FloatArray
from pilotage.kernels.jit import kernel

KNOTS = 32
KNOT = 2
"""Of a stretch: length driven, and its integral of the heading's variance."""
SUMS = 3
"""E[|e|^2] and E[e e] of the start's error and the odometer's distances, and cov(z0, w_0)."""
LEAST_VAR_M2 = 1e-12
"""A start known exactly is a region still."""
REGION = 7
"""Direction of u, sigma, bend along and across, var(x) as a polynomial from degree 0."""


@kernel
def add_move(
    moves: ComplexArray,
    knots: FloatArray,
    sums: ComplexArray,
    count: int,
    move: complex,
    heading_var: float,
    q_distance: float,
) -> int:
    """Add a step to ``moves`` (KNOTS,), ``knots`` (KNOTS, KNOT) and ``sums`` (SUMS,).

    Returns how many stretches there are. ``move`` is told along the measured headings, ``heading_var`` is the
    heading's variance during it.
    """
    length = abs(move)
    if length == 0.0:
        return count
    u = move / length
    sums[0] += q_distance
    sums[1] += u * u * q_distance
    last = count - 1
    if count == 0 or knots[last, 0] >= 0.99 * knots[0, 0]:
        if count == KNOTS:
            for k in range(KNOTS // 2):
                moves[k] = moves[2 * k] + moves[2 * k + 1]
                for i in range(KNOT):
                    knots[k, i] = knots[2 * k, i] + knots[2 * k + 1, i]
            count = KNOTS // 2
        last, count = count, count + 1
        moves[last], knots[last, 0], knots[last, 1] = 0.0, 0.0, 0.0
    moves[last] += move
    knots[last, 0] += length
    knots[last, 1] += length * heading_var
    return count


@kernel
def _walk_form(heading_var: FloatArray, p: FloatArray, r: FloatArray, count: int, power: int) -> float:
    """Sum over j and k of p_j r_k min(v_j, v_k)^power: v grows along the path."""
    total, later_p, later_r = 0.0, 0.0, 0.0
    for k in range(count - 1, -1, -1):
        total += heading_var[k] ** power * (p[k] * r[k] + p[k] * later_r + r[k] * later_p)
        later_p += p[k]
        later_r += r[k]
    return total


@kernel
def region(moves: ComplexArray, knots: FloatArray, sums: ComplexArray, count: int, out: FloatArray) -> None:
    """Write the region (REGION,) about the plain sum of the moves."""
    v, c, h = np.empty(KNOTS), np.empty(KNOTS), np.empty(KNOTS)
    p0, p1 = np.empty(KNOTS), np.empty(KNOTS)
    A, B, start = sums[0].real, sums[1], sums[2]
    for k in range(count):
        v[k] = knots[k, 1] / knots[k, 0]
    # First order: the error's moments E[|e|^2] and E[e e], by the walk's covariance min(v_j, v_k).
    later = 0.0 + 0.0j
    for k in range(count - 1, -1, -1):
        a = moves[k]
        A += v[k] * (abs(a) ** 2 + 2.0 * (a.conjugate() * later).real) - 2.0 * (a * start.conjugate()).imag
        B += 2j * a * start - v[k] * (a * a + 2.0 * a * later)
        later += a
    u = cmath.exp(0.5j * cmath.phase(B)) if B != 0.0 else 1.0 + 0.0j
    sigma = math.sqrt(max(0.5 * (A + abs(B)), LEAST_VAR_M2))
    # c_k = cov(w_k, x), where the error along u is that of the start less the sum of h_k w_k.
    begun, turned, still = start / u, 0.0, 0.0
    for k in range(count):
        h[k] = (moves[k] / u).imag
        still += h[k]
    aside_all = still
    for k in range(count):
        still -= h[k]
        turned += v[k] * h[k]
        c[k] = (begun.real - turned - v[k] * still) / sigma
    # The start's and the odometer's part, x given.
    N = sums[1] / (u * u)
    aside = (0.5 * N.imag - begun.imag * aside_all) / sigma
    short, bend, q0, q1 = 0.0, 0.0 + 0.0j, 0.5 * (sums[0].real - N.real) - aside * aside, 0.0
    c_p0, c_p1, c_hc = 0.0, 0.0, 0.0
    for k in range(count):
        a = moves[k] / u
        short += 0.5 * h[k] * (v[k] - c[k] * c[k])
        bend -= 0.5 * a * c[k] * c[k]
        p0[k], p1[k] = a.real, -a.imag * c[k]
        between = begun.imag - c[k] * aside
        q0 += 2.0 * p0[k] * between
        q1 += 2.0 * p1[k] * between
        c_p0 += c[k] * p0[k]
        c_p1 += c[k] * p1[k]
        c_hc += h[k] * c[k] * c[k]
    q0 += _walk_form(v, p0, p0, count, 1) - c_p0 * c_p0
    q1 += 2.0 * (_walk_form(v, p0, p1, count, 1) - c_p0 * c_p1)
    q2 = _walk_form(v, p1, p1, count, 1) - c_p1 * c_p1
    # p1 is -h c: the second order's three sums are of h, min^2, and of p1.
    q0 += short * short + 0.5 * (
        _walk_form(v, h, h, count, 2) - 2.0 * _walk_form(v, p1, p1, count, 1) + c_hc * c_hc
    )
    out[0], out[1] = cmath.phase(u), sigma
    out[2], out[3] = bend.real, bend.imag
    out[4], out[5], out[6] = max(q0, LEAST_VAR_M2), q1, q2
