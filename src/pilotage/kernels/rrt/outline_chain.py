"""The cheapest chain of curves and of a path's own pieces between places along it, for an outline."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.hybrid import word_fits
from pilotage.kernels.rrt.outline_star import LOOK_M, Driver
from pilotage.kernels.rrt.steering import curve_between, gears_of, least_price


@kernel
def cheapest_chain(
    places: FloatArray, own: FloatArray, gears: IntArray, driver: Driver
) -> tuple[IntArray, BoolArray]:
    """Which of the places along a path are kept, and whether the path itself leads to each, or a curve.

    Exact dynamic programming over a place and the direction in which it is reached, as a change of direction
    there has its price.

    Parameters
    ----------
    places
        (M, 3) along the path, first its start and last its goal.
    own, gears
        (M - 1,) price of the path's own pieces between them, and (M - 1, 2) the directions, 1 and -1, in
        which each begins and ends.

    Returns
    -------
    Places (K,), and (K - 1,) whether the piece that leads to each but the first is the path's own.
    """
    m = places.shape[0]
    steering = driver.steering
    cost = np.full((m, 2), math.inf)  # reached forwards, backwards
    before = np.full((m, 2), -1, np.int64)
    came = np.zeros((m, 2), np.int64)
    kept = np.zeros((m, 2), np.bool_)
    cost[0, 0] = cost[0, 1] = 0.0
    for j in range(1, m):
        x, y, th = places[j, 0], places[j, 1], places[j, 2]
        for i in range(j - 1, -1, -1):
            px, py, pth = places[i, 0], places[i, 1], places[i, 2]
            if i == j - 1:
                first, last, price = gears[i, 0], gears[i, 1], own[i]
                _reach(cost, before, came, kept, i, j, first, last, price, i == 0, True, steering.switch_cost)
            # Dearer than the other direction and a change to it, a direction is of no use.
            most = min(cost[j, 0], cost[j, 1]) + steering.switch_cost - 1e-9
            least = min(cost[i, 0], cost[i, 1]) + least_price(px, py, pth, x, y, th, steering)
            if least >= most:
                continue
            word, price = curve_between(px, py, pth, x, y, th, steering)
            if min(cost[i, 0], cost[i, 1]) + price >= most:
                continue
            if word_fits(px, py, pth, word, driver.car, driver.ground, LOOK_M):
                first, last = gears_of(word)
                _reach(
                    cost, before, came, kept, i, j, first, last, price, i == 0, False, steering.switch_cost
                )
    chain, lines = np.empty(m, np.int64), np.empty(m, np.bool_)
    n, j, side = 0, m - 1, 0 if cost[m - 1, 0] <= cost[m - 1, 1] else 1
    while j > 0:
        chain[n], lines[n] = j, kept[j, side]
        n += 1
        j, side = before[j, side], came[j, side]
    chain[n] = 0
    return chain[: n + 1][::-1].copy(), lines[:n][::-1].copy()


@kernel
def _reach(
    cost: FloatArray,
    before: IntArray,
    came: IntArray,
    kept: BoolArray,
    i: int,
    j: int,
    first: int,
    last: int,
    price: float,
    from_start: bool,
    is_own: bool,
    switch_cost: float,
) -> None:
    """Note a piece from place i to j, begun in one direction and ended in another, where it is cheaper."""
    side = 0 if last >= 0 else 1
    for arrived in range(2):
        total = cost[i, arrived] + price
        if not from_start and first * (1 - 2 * arrived) < 0:
            total += switch_cost
        if total < cost[j, side] - 1e-9:
            cost[j, side], before[j, side], came[j, side], kept[j, side] = total, i, arrived, is_own
