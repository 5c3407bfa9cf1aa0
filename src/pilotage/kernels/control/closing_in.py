"""How near a robot comes to moving bodies, and whether it is its own motion that brings it there."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.bodies.outline import signed_distance
from pilotage.kernels.control.footprint import polygon_distance
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.geometry.solids import Outline
from pilotage.kernels.jit import kernel

CLOSES_M = 1e-4
"""Of rounding: less is no motion towards anybody, and no speed."""
AWAY = 0.3
"""Share of its motion by which a robot gains distance from those whom it drives away from."""


@kernel
def movers_clearance(
    x: float, y: float, theta: float, polygon: FloatArray, outer: float, movers: FloatArray, enough: float
) -> float:
    """Least distance of a footprint to discs (M, 3) at one time, at most ``enough``; negative inside."""
    best = enough
    c, s = math.cos(theta), math.sin(theta)
    for i in range(movers.shape[0]):
        dx, dy = movers[i, 0] - x, movers[i, 1] - y
        if math.sqrt(dx * dx + dy * dy) - movers[i, 2] - outer >= best:
            continue
        best = min(best, polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon) - movers[i, 2])
    return best


@kernel
def closes_in(
    before: tuple[float, float, float],
    after: tuple[float, float, float],
    polygon: FloatArray,
    outer: float,
    movers: FloatArray,
    keep: float,
) -> bool:
    """Whether a footprint's own motion brings it nearer to one of the discs (M, 3) that is within ``keep``.

    The discs stand while it moves, from pose to pose: who drives away, and not merely past (``AWAY``: places
    are vague), closes no gap. Who turns on the spot swings corners to all sides, and counts as the disc of
    radius ``outer``.
    """
    x, y, theta = after
    x0, y0, theta0 = before
    moved = math.hypot(x - x0, y - y0)
    spins = abs(wrap(theta - theta0)) * outer > moved
    c, s = math.cos(theta), math.sin(theta)
    for i in range(movers.shape[0]):
        dx, dy = movers[i, 0] - x, movers[i, 1] - y
        reach = movers[i, 2] + keep
        if math.sqrt(dx * dx + dy * dy) - outer >= reach:
            continue
        if spins:
            return True
        away = polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon)
        if away >= reach:
            continue
        c0, s0 = math.cos(theta0), math.sin(theta0)
        dx, dy = movers[i, 0] - x0, movers[i, 1] - y0
        if away < polygon_distance(c0 * dx + s0 * dy, c0 * dy - s0 * dx, polygon) + AWAY * moved - CLOSES_M:
            return True
    return False


@kernel
def drive_closes_in(
    pose: tuple[float, float, float],
    v: float,
    w: float,
    hold: float,
    deceleration: float,
    dt: float,
    outline: Outline,
    movers: FloatArray,
    keep: float,
) -> bool:
    """Whether a command, held and then braked from along its arc, brings an outline nearer to somebody.

    ``movers`` (K, M, 3): discs at dt, 2 dt, ...; beyond the last ones time stands. Only those count that are
    within ``keep`` by then, and each stands while the robot moves: who drives away, and not merely past
    (``AWAY``: places are vague), closes no gap. Sides may slide along somebody, whose place then does not
    matter, but corners turn only away from him; a middle inside the outline is nobody's.
    """
    (x, y, theta), (corners, radius, _) = pose, outline
    rate = w / v if v != 0.0 else 0.0
    speed, t = v, 0.0
    for k in range(10 * movers.shape[0]):
        if t >= hold:
            left = abs(speed) - deceleration * dt
            if left <= CLOSES_M:
                return False
            speed = math.copysign(left, speed)
        turn = (rate * speed if v != 0.0 else w) * dt
        middle = theta + 0.5 * turn
        nx, ny = x + speed * dt * math.cos(middle), y + speed * dt * math.sin(middle)
        discs = movers[min(k, movers.shape[0] - 1)]
        for i in range(discs.shape[0]):
            px, py = discs[i, 0], discs[i, 1]
            after = math.hypot(px - nx, py - ny) - radius
            if after >= discs[i, 2] + keep:
                continue
            if corners.shape[0] == 0:
                gained, least = after + radius - math.hypot(px - x, py - y), AWAY * abs(speed) * dt
            else:
                after = _gap(px - nx, py - ny, theta + turn, corners)
                if after >= discs[i, 2] + keep:
                    continue
                before = _gap(px - x, py - y, theta, corners)
                if before < 0.0:
                    continue
                gained = after - before
                least = AWAY * radius * abs(turn) - CLOSES_M
            if gained < least:
                return True
        x, y, theta, t = nx, ny, theta + turn, t + dt
    return True


@kernel
def _gap(dx: float, dy: float, theta: float, corners: FloatArray) -> float:
    """Signed distance of a point, seen from the base but not turned, to an outline that is."""
    c, s = math.cos(theta), math.sin(theta)
    return signed_distance(c * dx + s * dy, c * dy - s * dx, corners)
