"""Odometry motion on the plane: the exact arc, the mid-angle model, and their Jacobians."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

TWO_PI = 2.0 * math.pi


@kernel
def wrap(angle: float) -> float:
    """Wrap a direction to [-pi, pi)."""
    if -math.pi <= angle < math.pi:
        return angle  # nearly always; the modulo costs as much as the rest of a filter's step
    wrapped = (angle + math.pi) % TWO_PI - math.pi
    return -math.pi if wrapped >= math.pi else wrapped


@kernel
def chord_ratio(angle: float) -> float:
    """Chord over arc length of an arc that turns by ``angle``: sin(a/2) / (a/2)."""
    half = 0.5 * angle
    if abs(half) < 1e-4:
        return 1.0 - half * half / 6.0  # the next term is below 1e-17
    return math.sin(half) / half


@kernel
def chord_ratio_slope(angle: float) -> float:
    """Derivative of ``chord_ratio`` with respect to the angle."""
    half = 0.5 * angle
    if abs(half) < 1e-3:
        return -half / 6.0 + half * half * half / 60.0
    return 0.5 * (half * math.cos(half) - math.sin(half)) / (half * half)


@kernel
def exact_arc(x: float, y: float, theta: float, distance: float, angle: float) -> tuple[float, float, float]:
    """End of an arc of length ``distance`` that turns by ``angle`` (Thrun et al. 2005, eq. 5.9).

    Written by its chord, which stays exact as the angle goes to zero.
    """
    chord = distance * chord_ratio(angle)
    middle = theta + 0.5 * angle
    return x + chord * math.cos(middle), y + chord * math.sin(middle), wrap(theta + angle)


@kernel
def turned_part(
    x: float, y: float, theta: float, distance: float, lateral: float, angle: float, part: float
) -> tuple[float, float, float]:
    """Pose after a part of a move at constant twist, without ``lateral`` an arc (Thrun et al. 2005, 5.9)."""
    turned = part * angle
    ratio = chord_ratio(turned)
    chord, side = part * distance * ratio, part * lateral * ratio
    middle = theta + 0.5 * turned
    c, s = math.cos(middle), math.sin(middle)
    return x + chord * c - side * s, y + chord * s + side * c, wrap(theta + turned)


@kernel
def mid_angle(x: float, y: float, theta: float, distance: float, angle: float) -> tuple[float, float, float]:
    """The night-watch report's odometry model, its eq. 1-3: the arc taken for its chord."""
    middle = theta + 0.5 * angle
    return x + distance * math.cos(middle), y + distance * math.sin(middle), wrap(theta + angle)


@kernel
def moved(
    x: float, y: float, theta: float, distance: float, angle: float, exact: bool
) -> tuple[float, float, float]:
    """``exact_arc`` or ``mid_angle``."""
    if exact:
        return exact_arc(x, y, theta, distance, angle)
    return mid_angle(x, y, theta, distance, angle)


@kernel
def sideways(theta: float, lateral: float, angle: float, exact: bool) -> tuple[float, float]:
    """How far x and y go besides, of a base that drives ``lateral`` to its left along an arc.

    ``theta`` is its heading at the end of the arc, which turned by ``angle``: all the way the left is a
    quarter turn from the arc's own direction, so this displacement's chord is, too.
    """
    chord = lateral * chord_ratio(angle) if exact else lateral
    middle = theta - 0.5 * angle
    return -chord * math.sin(middle), chord * math.cos(middle)


@kernel
def arc_jacobians(
    theta: float, distance: float, angle: float, exact: bool, F: FloatArray, G: FloatArray
) -> None:
    """Fill F (3, 3), the Jacobian in the pose, and G (3, 2), that in (distance, angle).

    ``exact`` chooses the exact arc, else the mid-angle model.
    """
    ratio = chord_ratio(angle) if exact else 1.0
    slope = chord_ratio_slope(angle) if exact else 0.0
    middle = theta + 0.5 * angle
    c, s = math.cos(middle), math.sin(middle)
    F[:, :] = 0.0
    F[0, 0] = F[1, 1] = F[2, 2] = 1.0
    F[0, 2] = -distance * ratio * s
    F[1, 2] = distance * ratio * c
    G[0, 0] = ratio * c
    G[1, 0] = ratio * s
    G[2, 0] = 0.0
    G[0, 1] = distance * (slope * c - 0.5 * ratio * s)
    G[1, 1] = distance * (slope * s + 0.5 * ratio * c)
    G[2, 1] = 1.0
