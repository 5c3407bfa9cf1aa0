"""Monte-Carlo localization: motion, likelihood field, tempering, low-variance resampling, KLD bound."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import moved, sideways, wrap
from pilotage.kernels.geometry.nearest import (
    SEVERAL,
    NearestGrid,
    distances_by_node,
    distances_to_item,
    item_throughout,
)
from pilotage.kernels.jit import kernel

BISECTIONS = 40
NODES_SHARE = 2
"""A cloud is looked up as one where that asks for no more nodes than one for so many particles."""
ROUNDING = 1e-12

Span: TypeAlias = tuple[float, float]
"""The least and the largest of several numbers."""


@kernel
def span(values: FloatArray) -> Span:
    """Of values (N,)."""
    low, high = math.inf, -math.inf
    for i in range(values.shape[0]):
        low, high = min(low, values[i]), max(high, values[i])
    return low, high


@kernel
def times(values: Span, factor: float) -> Span:
    """All of them times a factor."""
    a, b = values[0] * factor, values[1] * factor
    return min(a, b), max(a, b)


@kernel
def plus(one: Span, other: Span) -> Span:
    """Of sums of one each, and a little more, so that none is left out by rounding."""
    low, high = one[0] + other[0], one[1] + other[1]
    return low - ROUNDING * abs(low), high + ROUNDING * abs(high)


@kernel
def sample_motion(
    poses: FloatArray,
    distance: float,
    angle: float,
    distance_std: float,
    angle_std: float,
    normals: FloatArray,
    exact: bool,
) -> None:
    """Move every particle (N, 3) in place by an increment drawn with its ``normals`` (N, 2)."""
    for i in range(poses.shape[0]):
        d = distance + distance_std * normals[i, 0]
        a = angle + angle_std * normals[i, 1]
        poses[i, 0], poses[i, 1], poses[i, 2] = moved(poses[i, 0], poses[i, 1], poses[i, 2], d, a, exact)


@kernel
def sample_sideways(
    poses: FloatArray, lateral: float, angle: float, lateral_std: float, normals: FloatArray, exact: bool
) -> None:
    """Move every particle (N, 3) in place by what a base drove to its left along an arc that turned by
    ``angle``, drawn with its ``normals`` (N,); after ``sample_motion``."""
    for i in range(poses.shape[0]):
        dx, dy = sideways(poses[i, 2], lateral + lateral_std * normals[i], angle, exact)
        poses[i, 0] += dx
        poses[i, 1] += dy


@kernel
def log_likelihoods(
    poses: FloatArray, points: FloatArray, grid: NearestGrid, table: FloatArray, table_step: float
) -> FloatArray:
    """Log-likelihood (N,) of a scan's end points (B, 2), in the base frame, at particles (N, 3).

    The likelihood field of Thrun et al. 2005, table 6.3: the distance from each end point to the nearest
    obstacle. ``table`` holds the logarithm of a beam's density at multiples of ``table_step``; its last
    entry stands for all beyond and for what is off the map.
    """
    nearest, x0, y0, resolution, items = grid
    last, count = table.shape[0] - 1, poses.shape[0]
    out = np.zeros(count)
    px, py, c, s = poses[:, 0].copy(), poses[:, 1].copy(), np.empty(count), np.empty(count)
    x, y = np.empty(count), np.empty(count)
    for i in range(count):
        c[i], s[i] = math.cos(poses[i, 2]), math.sin(poses[i, 2])
    of_x, of_y, of_c, of_s = span(px), span(py), span(c), span(s)
    per_step = 1.0 / table_step
    # Beam by beam for all particles: what is alike for many is computed for several at once.
    for k in range(points.shape[0]):
        u, v = points[k, 0], points[k, 1]
        for i in range(count):
            x[i] = px[i] + c[i] * u - s[i] * v
            y[i] = py[i] + s[i] * u + c[i] * v
        # Of a cloud that is narrow a beam ends before the same wall for all particles.
        low, high = plus(plus(of_x, times(of_c, u)), times(of_s, -v))
        bottom, top = plus(plus(of_y, times(of_s, u)), times(of_c, v))
        item = item_throughout((low, high, bottom, top), nearest, x0, y0, resolution, count // NODES_SHARE)
        if item == SEVERAL:
            away = distances_by_node(x, y, nearest, x0, y0, resolution, items)
        else:
            away = distances_to_item(x, y, items, item)
        for i in range(count):
            entry = away[i] * per_step + 0.5
            out[i] += table[np.uint64(entry if entry < last else last)]
    return out


@kernel
def effective_count(log_weights: FloatArray, exponent: float) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2, for weights w^exponent."""
    top = log_weights.max()
    total = squares = 0.0
    for i in range(log_weights.shape[0]):
        w = math.exp(exponent * (log_weights[i] - top))
        total += w
        squares += w * w
    return total * total / squares


@kernel
def largest_exponent(log_weights: FloatArray, most: float, least_effective: float) -> float:
    """Largest exponent up to ``most`` that leaves at least so many effective particles (bisection).

    Tempering: a likelihood much sharper than the cloud is let in by parts (Del Moral, Doucet and Jasra
    2006, sect. 3; the exponent by effective size as in Jasra et al. 2011).
    """
    if effective_count(log_weights, most) >= least_effective:
        return most
    low, high = 0.0, most
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if effective_count(log_weights, middle) >= least_effective:
            low = middle
        else:
            high = middle
    return low


@kernel
def normalized(log_weights: FloatArray, exponent: float) -> FloatArray:
    """Weights (N,) that sum to one."""
    top = log_weights.max()
    out = np.empty(log_weights.shape[0])
    total = 0.0
    for i in range(out.shape[0]):
        out[i] = math.exp(exponent * (log_weights[i] - top))
        total += out[i]
    for i in range(out.shape[0]):
        out[i] /= total
    return out


@kernel
def low_variance_indices(weights: FloatArray, count: int, start: float) -> IntArray:
    """Indices (count,) drawn by one comb of evenly spaced teeth (Thrun et al. 2005, table 4.4).

    ``start`` in [0, 1) is the comb's offset in teeth; particle i is drawn floor or ceil of count * w_i times.
    """
    out = np.empty(count, dtype=np.int64)
    i, reached = 0, weights[0]
    for k in range(count):
        tooth = (k + start) / count
        while tooth > reached and i < weights.shape[0] - 1:
            i += 1
            reached += weights[i]
        out[k] = i
    return out


@kernel
def moments(poses: FloatArray, weights: FloatArray, mean: FloatArray, cov: FloatArray) -> None:
    """Fill mean (3,) and covariance (3, 3) of weighted poses (N, 3); the heading's mean is circular."""
    x = y = c = s = 0.0
    for i in range(poses.shape[0]):
        w = weights[i]
        x += w * poses[i, 0]
        y += w * poses[i, 1]
        c += w * math.cos(poses[i, 2])
        s += w * math.sin(poses[i, 2])
    mean[0], mean[1], mean[2] = x, y, wrap(math.atan2(s, c))
    cov[:, :] = 0.0
    for i in range(poses.shape[0]):
        w = weights[i]
        dx, dy, dt = poses[i, 0] - x, poses[i, 1] - y, wrap(poses[i, 2] - mean[2])
        cov[0, 0] += w * dx * dx
        cov[0, 1] += w * dx * dy
        cov[0, 2] += w * dx * dt
        cov[1, 1] += w * dy * dy
        cov[1, 2] += w * dy * dt
        cov[2, 2] += w * dt * dt
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]


@kernel
def spread_out(poses: FloatArray, mean: FloatArray, root: FloatArray, h: float, normals: FloatArray) -> None:
    """Move resampled particles (N, 3) apart in place by a kernel that leaves mean and covariance as they are.

    Each is drawn towards the mean by a = sqrt(1 - h^2) and moved by h times a normal variable with the
    cloud's covariance, whose square root is ``root`` (3, 3) (Liu and West 2001, sect. 10.3.3).
    """
    a = math.sqrt(1.0 - h * h)
    for i in range(poses.shape[0]):
        n0, n1, n2 = h * normals[i, 0], h * normals[i, 1], h * normals[i, 2]
        dt = wrap(poses[i, 2] - mean[2])
        poses[i, 0] = mean[0] + a * (poses[i, 0] - mean[0]) + root[0, 0] * n0
        poses[i, 1] = mean[1] + a * (poses[i, 1] - mean[1]) + root[1, 0] * n0 + root[1, 1] * n1
        poses[i, 2] = wrap(mean[2] + a * dt + root[2, 0] * n0 + root[2, 1] * n1 + root[2, 2] * n2)


@kernel
def occupied_bins(poses: FloatArray, side: float, angle: float) -> int:
    """Number of bins of ``side`` x ``side`` x ``angle`` that hold at least one particle (N, 3)."""
    keys = np.empty(poses.shape[0], dtype=np.int64)
    turns = math.ceil(2.0 * math.pi / angle)
    for i in range(poses.shape[0]):
        column = math.floor(poses[i, 0] / side) + (1 << 20)
        row = math.floor(poses[i, 1] / side) + (1 << 20)
        turn = math.floor((poses[i, 2] + math.pi) / angle)
        keys[i] = (row * (1 << 21) + column) * turns + turn
    keys.sort()
    count = 1
    for i in range(1, keys.shape[0]):
        if keys[i] != keys[i - 1]:
            count += 1
    return count


@kernel
def kld_count(bins: int, error: float, quantile: float) -> float:
    """Particles that keep the KL distance to the true posterior below ``error`` (Fox 2003, eq. 7).

    ``quantile`` is the standard normal's at the probability wanted.
    """
    if bins < 2:
        return 1.0
    k = bins - 1.0
    a = 2.0 / (9.0 * k)
    return k / (2.0 * error) * (1.0 - a + math.sqrt(a) * quantile) ** 3
