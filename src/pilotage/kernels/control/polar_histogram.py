"""VFH+: a polar histogram of the obstacle cells around the robot, and the openings in it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

TWO_PI = 2.0 * math.pi


@kernel
def polar_histogram(
    x: float, y: float, ground: Ground, active_m: float, enlarged_m: float, sectors: int
) -> tuple[FloatArray, FloatArray]:
    """Primary histogram (sectors,) and each sector's nearest obstacle (sectors,), directions in the map.

    Each obstacle cell within ``active_m`` adds 1 - (distance / active)^2 to all sectors that it covers when
    it is enlarged by ``enlarged_m`` (Ulrich and Borenstein 1998, their eq. 2 to 5 with full certainty).
    """
    histogram = np.zeros(sectors)
    distance = np.full(sectors, np.inf)
    n = ground.hits.shape[0]
    hits, mean = ground.hits, ground.mean
    width = TWO_PI / sectors
    r0 = max(0, math.floor((y - active_m - ground.y0_m) * ground.per_cell))
    r1 = min(n - 1, math.floor((y + active_m - ground.y0_m) * ground.per_cell))
    c0 = max(0, math.floor((x - active_m - ground.x0_m) * ground.per_cell))
    c1 = min(n - 1, math.floor((x + active_m - ground.x0_m) * ground.per_cell))
    for row in range(r0, r1 + 1):
        for column in range(c0, c1 + 1):
            if hits[row, column] == 0:
                continue
            dx, dy = mean[row * n + column, 0] - x, mean[row * n + column, 1] - y
            d = math.hypot(dx, dy)
            if d > active_m:
                continue
            half = math.asin(enlarged_m / d) if d > enlarged_m else 0.5 * math.pi
            bearing = math.atan2(dy, dx)
            weight = 1.0 - (d / active_m) ** 2
            low = math.ceil((bearing - half) / width - 0.5)
            high = math.floor((bearing + half) / width - 0.5)
            for k in range(low, high + 1):
                sector = k % sectors
                histogram[sector] += weight
                distance[sector] = min(distance[sector], d)
    return histogram, distance


@kernel
def binary_histogram(histogram: FloatArray, before: BoolArray, low: float, high: float) -> BoolArray:
    """Blocked sectors (sectors,): above ``high``; between the thresholds as they were before (hysteresis)."""
    out = np.empty(histogram.shape[0], np.bool_)
    for k in range(histogram.shape[0]):
        out[k] = histogram[k] > high or (before[k] and histogram[k] >= low)
    return out


@kernel
def best_opening(
    blocked: BoolArray,
    target: float,
    heading: float,
    before: float,
    wide: int,
    target_cost: float,
    heading_cost: float,
    before_cost: float,
) -> tuple[float, float]:
    """The cheapest direction among the openings' candidates, and its cost; inf where all is blocked.

    A narrow opening offers its middle, a wide one both sides (``wide`` / 2 sectors in) and the target's
    direction where that lies between them (Ulrich and Borenstein 1998, eq. 11 to 15). Angles in radians.
    """
    sectors = blocked.shape[0]
    width = TWO_PI / sectors
    best, chosen = math.inf, heading
    first = -1
    for k in range(sectors):
        if blocked[k]:
            first = k
            break
    if first < 0:
        return target, target_cost * 0.0 + heading_cost * abs(wrap(target - heading))
    k = 1
    while k <= sectors:
        if blocked[(first + k) % sectors]:
            k += 1
            continue
        begin = k
        while k <= sectors and not blocked[(first + k) % sectors]:
            k += 1
        size = k - begin
        left = (first + begin + 0.5) * width
        candidates = np.empty(3)
        count = 0
        if size < wide:
            candidates[0] = left + 0.5 * (size - 1) * width
            count = 1
        else:
            inset = 0.5 * wide * width
            candidates[0] = left + inset
            candidates[1] = left + (size - 1) * width - inset
            count = 2
            along = (target - candidates[0]) % TWO_PI
            if along <= candidates[1] - candidates[0]:
                candidates[2] = target
                count = 3
        for i in range(count):
            cost = (
                target_cost * abs(wrap(candidates[i] - target))
                + heading_cost * abs(wrap(candidates[i] - heading))
                + before_cost * abs(wrap(candidates[i] - before))
            )
            if cost < best:
                best, chosen = cost, wrap(candidates[i])
    return chosen, best
