"""Reeds-Shepp curves: the shortest paths of bounded curvature between poses for a car that may reverse.

A curve is a word of at most five pieces: left arc (+1), right arc (-1), straight (0), each with a signed
length, negative backwards. The families are equations 8.1 to 8.11 of Reeds and Shepp (1990), Pacific J.
Math. 145(2); the others follow by driving backwards (timeflip), by reflection, and by both. Every word is
checked by where it ends: one that does not end at the goal is none.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

PIECES = 5
MATCH = 1e-6
HALF_PI = 0.5 * math.pi


@kernel
def _wrap(angle: float) -> float:
    """To (-pi, pi]."""
    wrapped = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
    return wrapped - 2.0 * math.pi if wrapped > math.pi else wrapped


@kernel
def _tau_omega(u: float, v: float, xi: float, eta: float, phi: float) -> tuple[float, float]:
    """First and last arc of the words with four arcs (their section 8.7)."""
    delta = _wrap(u - v)
    a, b = math.sin(u) - math.sin(delta), math.cos(u) - math.cos(delta) - 1.0
    t1 = math.atan2(eta * a - xi * b, xi * a + eta * b)
    t2 = 2.0 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3.0
    tau = _wrap(t1 + math.pi) if t2 < 0.0 else _wrap(t1)
    return tau, _wrap(tau - u + v - phi)


@kernel
def _set(out: FloatArray, row: int, turn: float, length: float) -> None:
    out[row, 0], out[row, 1] = turn, length


@kernel
def _family(
    which: int,
    phi: float,
    xi: float,
    eta: float,
    rho_i: float,
    xj: float,
    ej: float,
    rho_j: float,
    out: FloatArray,
) -> bool:
    """The word of one family that begins with a left arc, unit radius; fills (5, 2) turn and length.

    ``xi``, ``eta``, ``rho_i``: from the middle of the first arc's circle to that of a last one to the left,
    and how far that is; ``xj``, ``ej``, ``rho_j`` to that of a last one to the right.
    """
    out[:, :] = 0.0
    if which == 0:  # L+ S+ L+ (8.1)
        t = math.atan2(eta, xi)
        _set(out, 0, 1.0, t)
        _set(out, 1, 0.0, rho_i)
        _set(out, 2, 1.0, _wrap(phi - t))
        return True
    if which == 1 and rho_j >= 2.0:  # L+ S+ R+ (8.2)
        u = math.sqrt(rho_j * rho_j - 4.0)
        t = _wrap(math.atan2(ej, xj) + math.atan2(2.0, u))
        _set(out, 0, 1.0, t)
        _set(out, 1, 0.0, u)
        _set(out, 2, -1.0, _wrap(t - phi))
        return True
    if which in (2, 3, 4) and rho_i <= 4.0:  # L R L (8.3, 8.4)
        u = -2.0 * math.asin(0.25 * rho_i)
        t = _wrap(math.atan2(eta, xi) + 0.5 * u + math.pi)
        _set(out, 0, 1.0, t)
        _set(out, 1, -1.0, u)
        _set(out, 2, 1.0, _wrap(phi - t + u))
        if which == 3:  # the middle arc the other way round
            out[1, 1] = u + 2.0 * math.pi
        elif which == 4:
            out[1, 1] = u - 2.0 * math.pi
        return True
    if which == 5:  # L+ R+ L- R- (8.7)
        rho = 0.25 * (2.0 + rho_j)
        if rho <= 1.0:
            u = math.acos(rho)
            t, v = _tau_omega(u, -u, xj, ej, phi)
            _set(out, 0, 1.0, t)
            _set(out, 1, -1.0, u)
            _set(out, 2, 1.0, -u)
            _set(out, 3, -1.0, v)
            return True
    if which == 6:  # L+ R- L- R+ (8.8)
        rho = (20.0 - rho_j * rho_j) / 16.0
        if 0.0 <= rho <= 1.0:
            u = -math.acos(rho)
            t, v = _tau_omega(u, u, xj, ej, phi)
            _set(out, 0, 1.0, t)
            _set(out, 1, -1.0, u)
            _set(out, 2, 1.0, u)
            _set(out, 3, -1.0, v)
            return True
    if which == 7 and rho_i >= 2.0:  # L+ R- S- L- (8.9)
        r = math.sqrt(rho_i * rho_i - 4.0)
        t = _wrap(math.atan2(eta, xi) + math.atan2(r, -2.0))
        _set(out, 0, 1.0, t)
        _set(out, 1, -1.0, -HALF_PI)
        _set(out, 2, 0.0, 2.0 - r)
        _set(out, 3, 1.0, _wrap(phi - HALF_PI - t))
        return True
    if which == 8 and rho_j >= 2.0:  # L+ R- S- R- (8.10)
        t = math.atan2(xj, -ej)
        _set(out, 0, 1.0, t)
        _set(out, 1, -1.0, -HALF_PI)
        _set(out, 2, 0.0, 2.0 - rho_j)
        _set(out, 3, -1.0, _wrap(t + HALF_PI - phi))
        return True
    if which == 9 and rho_j >= 2.0:  # L+ R- S- L- R+ (8.11)
        u = 4.0 - math.sqrt(rho_j * rho_j - 4.0)
        if u <= 0.0:
            t = _wrap(math.atan2((4.0 - u) * xj - 2.0 * ej, -2.0 * xj + (u - 4.0) * ej))
            _set(out, 0, 1.0, t)
            _set(out, 1, -1.0, -HALF_PI)
            _set(out, 2, 0.0, u)
            _set(out, 3, 1.0, -HALF_PI)
            _set(out, 4, -1.0, _wrap(t - phi))
            return True
    return False


@kernel
def follow(word: FloatArray, s: float, radius: float) -> tuple[float, float, float, float]:
    """Pose after ``s`` metres of a word from the origin, and the sign of the motion there."""
    x, y, theta, left, sign = 0.0, 0.0, 0.0, s / radius, 1.0
    for i in range(word.shape[0]):
        length = word[i, 1]
        if length == 0.0:
            continue
        part = min(left, abs(length))
        sign = 1.0 if length > 0.0 else -1.0
        d = sign * part
        turn = word[i, 0]
        if turn == 0.0:
            x += d * math.cos(theta)
            y += d * math.sin(theta)
        else:
            end = theta + turn * d
            x += turn * (math.sin(end) - math.sin(theta))
            y -= turn * (math.cos(end) - math.cos(theta))
            theta = end
        left -= part
        if left <= 0.0:
            break
    return x * radius, y * radius, theta, sign


@kernel
def word_length(word: FloatArray, radius: float) -> float:
    """Length of a word's path."""
    total = 0.0
    for i in range(word.shape[0]):
        total += abs(word[i, 1])
    return total * radius


@kernel
def shortest(
    x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, radius: float, reverse_cost: float
) -> tuple[FloatArray, float]:
    """The cheapest word (5, 2) from pose 0 to pose 1 and its cost, the length with what is reversed dearer.

    ``reverse_cost`` (at least 1) is what a metre backwards costs. There is always one.
    """
    dx, dy = x1 - x0, y1 - y0
    c, s = math.cos(th0), math.sin(th0)
    x, y, phi = (c * dx + s * dy) / radius, (c * dy - s * dx) / radius, _wrap(th1 - th0)
    cp, sp = math.cos(phi), math.sin(phi)
    xb, yb = x * cp + y * sp, x * sp - y * cp  # the goal seen from a path driven from its end
    best, best_cost = np.zeros((PIECES, 2)), math.inf
    word, trial = np.zeros((PIECES, 2)), np.zeros((PIECES, 2))
    for backwards in range(2):
        for reflected in range(2):
            for flipped in range(2):
                gx, gy, gp = (xb, yb, phi) if backwards == 1 else (x, y, phi)
                if flipped == 1:
                    gx, gp = -gx, -gp
                if reflected == 1:
                    gy, gp = -gy, -gp
                side, front = math.sin(gp), math.cos(gp)
                xi, eta = gx - side, gy - 1.0 + front
                xj, ej = gx + side, gy - 1.0 - front
                rho_i, rho_j = math.hypot(xi, eta), math.hypot(xj, ej)
                for which in range(10):
                    if not _family(which, gp, xi, eta, rho_i, xj, ej, rho_j, word):
                        continue
                    cost, used = 0.0, 0
                    for i in range(PIECES):
                        length = -word[i, 1] if flipped == 1 else word[i, 1]
                        cost += length if length >= 0.0 else -reverse_cost * length
                        if length != 0.0:
                            used = i + 1
                    # Few are cheaper than the cheapest so far: only those are looked at.
                    if not cost < best_cost - 1e-12:
                        continue
                    trial[:, :] = 0.0
                    for i in range(used):
                        source = used - 1 - i if backwards == 1 else i
                        turn, length = word[source, 0], word[source, 1]
                        trial[i, 0] = -turn if reflected == 1 else turn
                        trial[i, 1] = -length if flipped == 1 else length
                    ex, ey, eth, _ = follow(trial, math.inf, 1.0)
                    if abs(ex - x) > MATCH or abs(ey - y) > MATCH or abs(_wrap(eth - phi)) > MATCH:
                        continue
                    best_cost = cost
                    best[:, :] = trial
    return best, best_cost * radius
