"""Curves that a robot is steered along between poses: Dubins', or Reeds and Shepp's for who may reverse.

Either is a word as ``kernels.rrt.reeds_shepp`` has it. A curve's price is its length, with metres backwards
dearer, and something for each change of direction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt import dubins
from pilotage.kernels.rrt.reeds_shepp import PIECES, shortest

NOTHING = 1e-7
"""A piece shorter than this, in radii, is rounding: backwards it would count as a change of direction."""


class Steering(NamedTuple):
    """Turning radius [m], whether it may reverse, what a metre backwards costs, and a change of direction."""

    radius: float
    reverses: bool
    reverse_cost: float
    switch_cost: float


@kernel
def _fill(word: FloatArray, curve: dubins.Curve, sign: int) -> None:
    """A Dubins curve as a word; ``sign`` -1: it is driven backwards, as seen in a mirror behind the car."""
    word[:, :] = 0.0
    radius = curve.radius
    word[0, 1], word[1, 1] = sign * curve.l0 / radius, sign * curve.l1 / radius
    word[2, 1] = sign * curve.l2 / radius
    for piece in range(3):
        word[piece, 0] = sign * dubins.TURNS[curve.word, piece]
        if abs(word[piece, 1]) < NOTHING:
            word[piece, 1] = 0.0


@kernel
def curve_between(
    x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, steering: Steering
) -> tuple[FloatArray, float]:
    """The curve (5, 2) from pose 0 to pose 1, and its price."""
    if not steering.reverses:
        curve = dubins.shortest(x0, y0, th0, x1, y1, th1, steering.radius)
        word = np.empty((PIECES, 2))
        _fill(word, curve, 1)
        return word, dubins.length_of(curve)
    word, cost = shortest(x0, y0, th0, x1, y1, th1, steering.radius, steering.reverse_cost)
    gear = 0.0
    for piece in range(PIECES):
        if abs(word[piece, 1]) < NOTHING:
            word[piece, 1] = 0.0
            continue
        if gear * word[piece, 1] < 0.0:
            cost += steering.switch_cost
        gear = word[piece, 1]
    return word, cost


@kernel
def curve_to_point(
    x0: float, y0: float, th0: float, x1: float, y1: float, steering: Steering
) -> tuple[FloatArray, float]:
    """The curve from a pose to a point reached with any heading, without a change of direction; its price."""
    radius = steering.radius
    word = np.empty((PIECES, 2))
    curve = dubins.shortest_to_point(x0, y0, th0, x1, y1, radius)
    price, sign = dubins.length_of(curve), 1
    if steering.reverses:
        back = dubins.shortest_to_point(x0, y0, th0 + math.pi, x1, y1, radius)
        if steering.reverse_cost * dubins.length_of(back) < price:
            curve, sign = back, -1
            price = steering.reverse_cost * dubins.length_of(back)
    _fill(word, curve, sign)
    return word, price


@kernel
def least_price(
    x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, steering: Steering
) -> float:
    """What no curve between two poses is below: the straight line, and the turn on the tightest arc."""
    turned = th1 - th0
    turned -= 2.0 * math.pi * math.floor((turned + math.pi) / (2.0 * math.pi))
    return max(math.hypot(x1 - x0, y1 - y0), steering.radius * abs(turned))


@kernel
def gears_of(word: FloatArray) -> tuple[int, int]:
    """Direction, 1 forwards and -1 back, in which a curve begins and in which it ends; 0 of an empty one."""
    first, last = 0, 0
    for piece in range(word.shape[0]):
        if word[piece, 1] != 0.0:
            last = 1 if word[piece, 1] > 0.0 else -1
            if first == 0:
                first = last
    return first, last


@kernel
def shorten(word: FloatArray, longest: float) -> None:
    """Leave of a word what comes before ``longest`` radii."""
    left = longest
    for piece in range(word.shape[0]):
        part = min(left, abs(word[piece, 1]))
        word[piece, 1] = part if word[piece, 1] > 0.0 else -part
        left -= part
