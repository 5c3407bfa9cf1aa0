"""Returns of a laser around a disc: what is near, what is on no map, whose bodies they are of."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.field import Field, interpolate_at
from pilotage.kernels.jit import kernel

FITTED, NOT_ROUND = 0, 1
MOST_FITS, FEWEST_RETURNS, FIT_M, FIT_REACH = 12, 6, 1e-3, 1.6


@kernel
def scan_returns(
    ranges: FloatArray,
    directions: FloatArray,
    mount: FloatArray,
    pose: FloatArray,
    near_m: float,
    far_m: float,
    tolerance_m: float,
    tolerance_per_m: float,
    known: Field,
    sectors: int,
) -> tuple[FloatArray, FloatArray]:
    """Nearest returns by sector, and those that the known map does not explain.

    Parameters
    ----------
    ranges, directions
        (B,) and (B, 2) unit vectors of the beams in the sensor's frame.
    known
        Distances on the robot's own map; of no nodes for a robot that does not know where it is.
    near_m, far_m
        Returns nearer than this to the base are kept by sector; those nearer than that are looked at at all.

    Returns
    -------
    near
        (K, 2) base frame: the nearest return of each of ``sectors`` sectors around the base.
    strange
        (M, 2) base frame: returns farther from everything on the map than
        ``tolerance_m + tolerance_per_m * range``; none without a map.
    """
    known_m, x0, y0, resolution = known
    nearest = np.full(sectors, np.inf)
    points = np.empty((sectors, 2))
    strange = np.empty((ranges.shape[0], 2))
    count = 0
    cm, sm = math.cos(mount[2]), math.sin(mount[2])
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    for k in range(ranges.shape[0]):
        r = ranges[k]
        if r >= far_m:
            continue
        dx, dy = r * directions[k, 0], r * directions[k, 1]
        x, y = mount[0] + cm * dx - sm * dy, mount[1] + sm * dx + cm * dy
        away = math.hypot(x, y)
        if away < near_m:
            sector = min(int((math.atan2(y, x) + math.pi) / (2.0 * math.pi) * sectors), sectors - 1)
            if away < nearest[sector]:
                nearest[sector] = away
                points[sector, 0], points[sector, 1] = x, y
        if known_m.shape[0] > 1:
            mx, my = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y
            if interpolate_at(mx, my, known_m, x0, y0, resolution) > tolerance_m + tolerance_per_m * r:
                strange[count, 0], strange[count, 1] = x, y
                count += 1
    kept = 0
    near = np.empty((sectors, 2))
    for sector in range(sectors):
        if nearest[sector] < np.inf:
            near[kept] = points[sector]
            kept += 1
    return near[:kept].copy(), strange[:count].copy()


@kernel
def fitted(
    points: FloatArray, x: float, y: float, radius: float, reach: float, most_off: float
) -> tuple[float, float, int]:
    """The middle near (x, y) of a disc whose rim returns (M, 2) lie on, by least squares (Gauss and Newton).

    The return nearest to the laser, which ``bodies`` goes by, lies anywhere within a hand's breadth of a
    round body's front: its distance hardly changes there.

    Parameters
    ----------
    reach
        Returns so near to (x, y) count.
    most_off
        Of what is a disc the returns lie so near to its rim, root mean square.

    Returns
    -------
    x, y, status
        FITTED; NOT_ROUND and what was given where the returns are too few, or of something else.
    """
    cx, cy = x, y
    for _ in range(MOST_FITS):
        count, squares = 0, 0.0
        axx = axy = ayy = bx = by = 0.0
        for k in range(points.shape[0]):
            if math.hypot(points[k, 0] - x, points[k, 1] - y) > reach:
                continue
            dx, dy = points[k, 0] - cx, points[k, 1] - cy
            away = math.hypot(dx, dy)
            if away < 1e-6:
                return x, y, NOT_ROUND
            ux, uy, off = dx / away, dy / away, away - radius
            axx, axy, ayy = axx + ux * ux, axy + ux * uy, ayy + uy * uy
            bx, by, squares, count = bx + ux * off, by + uy * off, squares + off * off, count + 1
        determinant = axx * ayy - axy * axy
        if count < FEWEST_RETURNS or determinant < 1e-3 * count * count:
            return x, y, NOT_ROUND
        mx, my = (ayy * bx - axy * by) / determinant, (axx * by - axy * bx) / determinant
        if math.hypot(mx, my) < FIT_M:
            if math.sqrt(squares / count) > most_off or math.hypot(cx - x, cy - y) > radius:
                return x, y, NOT_ROUND
            return cx, cy, FITTED
        cx, cy = cx + mx, cy + my
    return x, y, NOT_ROUND


@kernel
def bodies(points: FloatArray, radius: float) -> FloatArray:
    """(K, 2) middles of discs that returns (M, 2) are of: a body's near side alone is seen.

    Of the returns that no body explains yet the one nearest to the origin is straight before its middle.
    """
    return round_bodies(points, radius, 0.0)


@kernel
def round_bodies(points: FloatArray, radius: float, most_off: float) -> FloatArray:
    """(K, 2) as ``bodies``, but of what is round the middle that all its returns tell (``fitted``)."""
    open_ = np.ones(points.shape[0], dtype=np.bool_)
    found = np.empty_like(points)
    count = 0
    while True:
        nearest, least = -1, np.inf
        for k in range(points.shape[0]):
            away = math.hypot(points[k, 0], points[k, 1])
            if open_[k] and away < least:
                nearest, least = k, away
        if nearest < 0:
            return found[:count].copy()
        behind = 1.0 + radius / max(least, 1e-6)
        x, y = behind * points[nearest, 0], behind * points[nearest, 1]
        if most_off > 0.0:
            x, y, _ = fitted(points, x, y, radius, FIT_REACH * radius, most_off)
        found[count, 0], found[count, 1] = x, y
        count += 1
        open_[nearest] = False
        for k in range(points.shape[0]):
            if open_[k] and math.hypot(points[k, 0] - x, points[k, 1] - y) < 1.2 * radius:
                open_[k] = False


@kernel
def within(points: FloatArray, reach: float) -> FloatArray:
    """Those of points (K, 2) that are nearer to the origin than ``reach``."""
    kept = np.empty_like(points)
    count = 0
    for k in range(points.shape[0]):
        if points[k, 0] * points[k, 0] + points[k, 1] * points[k, 1] < reach * reach:
            kept[count] = points[k]
            count += 1
    return kept[:count]


@kernel
def is_near_beside(
    points: FloatArray, pose: FloatArray, near: float, discs: FloatArray, margin: float
) -> bool:
    """Whether one of the returns (M, 2), in the frame of ``pose``, is so near to it and in none of discs.

    The discs (K, 3) are in the frame that ``pose`` is in, and wider by a margin.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for i in range(points.shape[0]):
        if math.hypot(points[i, 0], points[i, 1]) >= near:
            continue
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        is_beside = True
        for k in range(discs.shape[0]):
            is_beside &= not math.hypot(x - discs[k, 0], y - discs[k, 1]) < discs[k, 2] + margin
        if is_beside:
            return True
    return False


@kernel
def coming_on(
    points: FloatArray,
    before: FloatArray,
    dt: float,
    same: float,
    slow: float,
    radius: float,
    gap: float,
    reaction: float,
    deceleration: float,
) -> FloatArray:
    """Those of returns (M, 2) that come on faster than who keeps its own half of the distance could stop.

    How fast is told by the nearest of the returns (K, 2) of a scan before, ``dt`` earlier and in the same
    frame, that are within ``same`` of one: the front of who comes. Of what has just come into sight nothing
    is known, and what is as ``slow`` as this may stand.

    Parameters
    ----------
    radius, gap
        Of this robot, and what two keep between them.
    reaction, deceleration
        Of who comes, as ``safe_stop.stop_is_clear`` has them.
    """
    kept = np.empty_like(points)
    count = 0
    for i in range(points.shape[0]):
        away, speed = nearing(points[i, 0], points[i, 1], before, dt, same)
        if speed > slow and speed * reaction + 0.5 * speed * speed / deceleration > 0.5 * max(
            away - radius - gap, 0.0
        ):
            kept[count] = points[i]
            count += 1
    return kept[:count]


@kernel
def rolling_on(
    points: FloatArray,
    before: FloatArray,
    dt: float,
    same: float,
    slow: float,
    radius: float,
    gap: float,
    reaction: float,
    decelerations: FloatArray,
) -> FloatArray:
    """Of those of returns (M, 2) that need more than their own half of the distance to stop, where to take
    them to be, so that what they leave is this robot's half: (K, 2), nearer in the same directions.

    Parameters
    ----------
    before, dt, same, slow, radius, gap, reaction
        As ``coming_on``.
    decelerations
        (M,) of who may be seen there.
    """
    kept = np.empty_like(points)
    count = 0
    for i in range(points.shape[0]):
        away, speed = nearing(points[i, 0], points[i, 1], before, dt, same)
        free, rolls = away - radius - gap, speed * reaction + 0.5 * speed * speed / decelerations[i]
        if speed > slow and rolls > 0.5 * free > 0.0:
            kept[count] = points[i] * (radius + gap + 2.0 * max(free - rolls, 0.0)) / away
            count += 1
    return kept[:count]


@kernel
def nearing(px: float, py: float, before: FloatArray, dt: float, same: float) -> tuple[float, float]:
    """How far a return is away, and how fast it came nearer: by the nearest of those (K, 2) of a scan before
    that are within ``same`` of it; 0 where none is.
    """
    least = np.inf
    for k in range(before.shape[0]):
        bx, by = before[k, 0], before[k, 1]
        if (px - bx) * (px - bx) + (py - by) * (py - by) < same * same:
            least = min(least, bx * bx + by * by)
    away = math.hypot(px, py)
    return away, max(math.sqrt(least) - away, 0.0) / dt if least < np.inf else 0.0


@kernel
def rotated(points: FloatArray, angle: float) -> FloatArray:
    """Points (K, 2) turned around the origin."""
    c, s = math.cos(angle), math.sin(angle)
    out = np.empty_like(points)
    for k in range(points.shape[0]):
        out[k, 0], out[k, 1] = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
    return out
