"""An elastic band between obstacles, and the fastest speeds along it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.ground import FAR_M, Ground
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.jit import kernel

MOST_MOVE = 0.3
"""Of the spacing, in one iteration: a band does not jump over an obstacle."""


@kernel
def relax_band(
    band: FloatArray, ground: Ground, room: float, stiffness: float, push: float, iterations: int
) -> FloatArray:
    """Relax a band (N, 2) with both ends fixed: contracted, bent little, pushed away from obstacles.

    Internal and external forces of Quinlan and Khatib (1993): each point goes towards the middle of its
    neighbours and, below a distance of ``room``, away from the nearest obstacle point. The second point stays
    as well: it holds the heading.
    """
    out = band.copy()
    nearest, mean = ground.nearest, ground.mean
    n = nearest.shape[0]
    count = out.shape[0]
    for _ in range(iterations):
        for k in range(2, count - 1):
            spacing = math.hypot(out[k + 1, 0] - out[k - 1, 0], out[k + 1, 1] - out[k - 1, 1]) * 0.5
            mx = stiffness * (0.5 * (out[k - 1, 0] + out[k + 1, 0]) - out[k, 0])
            my = stiffness * (0.5 * (out[k - 1, 1] + out[k + 1, 1]) - out[k, 1])
            column = math.floor((out[k, 0] - ground.x0_m) * ground.per_cell)
            row = math.floor((out[k, 1] - ground.y0_m) * ground.per_cell)
            if 0 <= row < n and 0 <= column < n and nearest[row, column] >= 0:
                at = nearest[row, column]
                dx, dy = out[k, 0] - mean[at, 0], out[k, 1] - mean[at, 1]
                d = math.hypot(dx, dy)
                if 1e-6 < d < room:
                    force = push * (room - d) / d
                    mx += force * dx
                    my += force * dy
            size = math.hypot(mx, my)
            most = MOST_MOVE * max(spacing, 0.02)
            if size > most:
                mx, my = mx * most / size, my * most / size
            out[k, 0] += mx
            out[k, 1] += my
    return out


@kernel
def speed_profile(path: FloatArray, v_now: float, v_end: float, caps: FloatArray, drive: Drive) -> FloatArray:
    """Fastest speeds (N,) along a path (N, 2), under (N,) caps, the turn rate and both accelerations.

    Forward and backward pass over the phase plane (Bobrow et al. 1985, with constant accelerations): exact
    between the points for a straight path; the limit on turn acceleration is left out. Where ``v_now`` is too
    fast for what comes, the profile brakes as it can.
    """
    n = path.shape[0]
    out = caps.copy()
    step = np.zeros(n)
    for k in range(1, n):
        step[k] = math.hypot(path[k, 0] - path[k - 1, 0], path[k, 1] - path[k - 1, 1])
    for k in range(1, n - 1):
        ax, ay = path[k, 0] - path[k - 1, 0], path[k, 1] - path[k - 1, 1]
        bx, by = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        turn = abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
        mean = 0.5 * (step[k] + step[k + 1])
        if turn > 1e-9 and mean > 0.0:
            out[k] = min(out[k], drive.turn_rate * mean / turn)
    for k in range(n):
        out[k] = min(out[k], drive.speed)
    if n > 0:
        out[n - 1] = min(out[n - 1], v_end)
    for k in range(n - 2, -1, -1):
        out[k] = min(out[k], math.sqrt(out[k + 1] ** 2 + 2.0 * drive.deceleration * step[k + 1]))
    if n > 0 and out[0] > v_now:
        out[0] = max(v_now, 0.0)
    for k in range(1, n):
        out[k] = min(out[k], math.sqrt(out[k - 1] ** 2 + 2.0 * drive.acceleration * step[k]))
    return out


@kernel
def path_time(path: FloatArray, speeds: FloatArray) -> float:
    """Seconds along a path (N, 2) at speeds (N,) that change evenly between points; inf where it stands."""
    total = 0.0
    for k in range(1, path.shape[0]):
        step = math.hypot(path[k, 0] - path[k - 1, 0], path[k, 1] - path[k - 1, 1])
        mean = 0.5 * (speeds[k] + speeds[k - 1])
        if step > 0.0:
            if mean <= 0.0:
                return math.inf
            total += step / mean
    return total


@kernel
def path_distances(path: FloatArray, ground: Ground) -> FloatArray:
    """Distance (N,) from each point of a path (N, 2) to the obstacle point nearest to its cell."""
    n = ground.nearest.shape[0]
    nearest, mean = ground.nearest, ground.mean
    out = np.full(path.shape[0], FAR_M)
    for k in range(path.shape[0]):
        column = math.floor((path[k, 0] - ground.x0_m) * ground.per_cell)
        row = math.floor((path[k, 1] - ground.y0_m) * ground.per_cell)
        if 0 <= row < n and 0 <= column < n and nearest[row, column] >= 0:
            at = nearest[row, column]
            out[k] = math.hypot(mean[at, 0] - path[k, 0], mean[at, 1] - path[k, 1])
    return out
