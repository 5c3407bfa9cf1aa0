"""Walkers by the social force model (Helbing and Molnar 1995): a wish to get on, and keeping apart.

acceleration = (wished velocity - velocity) / relaxation + sum over others of strength e^(-gap / range) away
from them, less for those behind, + the same of walls. Walkers do not foresee: they meet in doors and push.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.field import interpolate_at
from pilotage.kernels.jit import kernel

AHEAD = 4
"""So many nodes along its path a walker heads for."""
BEHIND = 0.3
"""Share of the force that somebody straight behind exerts."""
FASTEST = 1.3
"""Times the wished speed that nobody exceeds."""


class Forces(NamedTuple):
    """Strengths (m/s^2) and ranges (m) of the forces, and the time (s) to take up the wished velocity."""

    relaxation: float
    people: float
    people_range: float
    walls: float
    walls_range: float


class Ground(NamedTuple):
    """A square lattice: distance to what is solid (ny, nx); by goal (G, ny * nx) costs and next nodes."""

    clearance: FloatArray
    cost: FloatArray
    parent: IntArray
    x0: float
    y0: float
    spacing: float


@kernel
def heading_for(x: float, y: float, goal: int, ground: Ground) -> tuple[float, float, float]:
    """Unit vector along the shortest path to a goal, and what is left of it; (0, 0, inf) without any."""
    ny, nx = ground.clearance.shape
    column = min(max(round((x - ground.x0) / ground.spacing), 0), nx - 1)
    row = min(max(round((y - ground.y0) / ground.spacing), 0), ny - 1)
    cost, parent = ground.cost[goal], ground.parent[goal]
    node, best = -1, math.inf
    for reach in (0, 2):
        for r in range(max(row - reach, 0), min(row + reach, ny - 1) + 1):
            for c in range(max(column - reach, 0), min(column + reach, nx - 1) + 1):
                if cost[r * nx + c] < best:
                    node, best = r * nx + c, cost[r * nx + c]
        if node >= 0:
            break
    if node < 0:
        return 0.0, 0.0, math.inf
    for _ in range(AHEAD):
        if parent[node] >= 0:
            node = parent[node]
    dx = ground.x0 + (node % nx) * ground.spacing - x
    dy = ground.y0 + (node // nx) * ground.spacing - y
    away = math.hypot(dx, dy)
    if away == 0.0:
        return 0.0, 0.0, best
    return dx / away, dy / away, best


@kernel
def clearance_slope(x: float, y: float, ground: Ground) -> tuple[float, float, float]:
    """Distance to what is solid, and the unit vector away from it; (d, 0, 0) where it points nowhere."""
    h = 0.5 * ground.spacing
    field, x0, y0, spacing = ground.clearance, ground.x0, ground.y0, ground.spacing
    here = interpolate_at(x, y, field, x0, y0, spacing)
    gx = interpolate_at(x + h, y, field, x0, y0, spacing) - interpolate_at(x - h, y, field, x0, y0, spacing)
    gy = interpolate_at(x, y + h, field, x0, y0, spacing) - interpolate_at(x, y - h, field, x0, y0, spacing)
    steep = math.hypot(gx, gy)
    if steep < 1e-9:
        return here, 0.0, 0.0
    return here, gx / steep, gy / steep


@kernel
def walk(
    walkers: FloatArray,
    goals: IntArray,
    others: FloatArray,
    ground: Ground,
    forces: Forces,
    dt: float,
    left: FloatArray,
) -> None:
    """One step of all walkers in place.

    Parameters
    ----------
    walkers
        (K, 6) x, y, velocity x and y, wished speed, radius.
    goals
        (K,) which goal each is on its way to.
    others
        (M, 3) discs of everybody else, NaN for who is not there.
    left
        (K,) out: what is left of each one's path.
    """
    count = walkers.shape[0]
    push = np.zeros((count, 2))
    for k in range(count):
        x, y, vx, vy, speed, radius = walkers[k]
        hx, hy, left[k] = heading_for(x, y, goals[k], ground)
        ax, ay = (speed * hx - vx) / forces.relaxation, (speed * hy - vy) / forces.relaxation
        for i in range(count + others.shape[0]):
            if i == k:
                continue
            if i < count:
                px, py, other = walkers[i, 0], walkers[i, 1], walkers[i, 5]
            else:
                px, py, other = others[i - count, 0], others[i - count, 1], others[i - count, 2]
            dx, dy = x - px, y - py
            away = math.hypot(dx, dy)
            if not 0.0 < away < other + radius + 8.0 * forces.people_range:
                continue
            ahead = -(dx * hx + dy * hy) / away
            seen = BEHIND + (1.0 - BEHIND) * 0.5 * (1.0 + ahead)
            force = forces.people * math.exp((radius + other - away) / forces.people_range) * seen / away
            ax += force * dx
            ay += force * dy
        clear, nx, ny = clearance_slope(x, y, ground)
        wall = forces.walls * math.exp((radius - clear) / forces.walls_range)
        push[k, 0], push[k, 1] = ax + wall * nx, ay + wall * ny
    for k in range(count):
        vx, vy = walkers[k, 2] + dt * push[k, 0], walkers[k, 3] + dt * push[k, 1]
        fast = math.hypot(vx, vy) / (FASTEST * walkers[k, 4])
        if fast > 1.0:
            vx, vy = vx / fast, vy / fast
        x, y, radius = walkers[k, 0] + dt * vx, walkers[k, 1] + dt * vy, walkers[k, 5]
        clear, nx, ny = clearance_slope(x, y, ground)
        if clear < radius:
            x, y = x + (radius - clear) * nx, y + (radius - clear) * ny
            vx, vy = (x - walkers[k, 0]) / dt, (y - walkers[k, 1]) / dt
        walkers[k, 0], walkers[k, 1], walkers[k, 2], walkers[k, 3] = x, y, vx, vy
