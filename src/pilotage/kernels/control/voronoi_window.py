"""The dynamic window of a disc among others that do the same: nobody leaves its buffered Voronoi cell."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.eikonal import descent, value_at
from pilotage.kernels.geometry.field import interpolate_at
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.kernels.jit import kernel

ARC_STEP_M = 0.08
FREE, HELD = 0, 1


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
    known: FloatArray,
    x0: float,
    y0: float,
    resolution: float,
    sectors: int,
) -> tuple[FloatArray, FloatArray]:
    """Nearest returns by sector, and those that the known map does not explain.

    Parameters
    ----------
    ranges, directions
        (B,) and (B, 2) unit vectors of the beams in the sensor's frame.
    known
        Distance field of the robot's own map; empty (0, 0) for a robot that does not know where it is.
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
        if known.shape[0] > 1:
            mx, my = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y
            if interpolate_at(mx, my, known, x0, y0, resolution) > tolerance_m + tolerance_per_m * r:
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
def stop_is_clear(
    v: float,
    w: float,
    reaction_s: float,
    deceleration: float,
    radius: float,
    margin: float,
    near: FloatArray,
    strange: FloatArray,
    gap: float,
) -> bool:
    """Whether a disc that goes on for ``reaction_s`` and then brakes comes to rest clear of everything.

    From returns of what stands it keeps ``margin``; of what may move, the half of the distance between both
    that is its own, less half of ``gap`` (the buffered Voronoi cell of Zhou et al. 2017, with distances to
    what is seen instead of to middles): two that both do so never touch, whatever each of them decides.
    Where it is nearer than that already it may move only away. Turning on the spot is always free.

    Parameters
    ----------
    near, strange
        (K, 2) and (M, 2) returns, base frame; the latter of what may move.
    """
    length = abs(v) * reaction_s + 0.5 * v * v / deceleration
    if length < 1e-4:
        return True
    turned = length * w / v if abs(v) > 1e-6 else 0.0
    if v < 0.0:
        length = -length
    steps = max(1, math.ceil(abs(length) / ARC_STEP_M))
    apart = (radius + margin) * (radius + margin)
    for k in range(1, steps + 1):
        x, y, _ = exact_arc(0.0, 0.0, 0.0, length * k / steps, turned * k / steps)
        for i in range(near.shape[0]):
            px, py = near[i, 0], near[i, 1]
            squared = (px - x) * (px - x) + (py - y) * (py - y)
            # Nearer than the margin, and nearer than where it stands.
            if squared < apart and squared < px * px + py * py - 1e-5:
                return False
        for i in range(strange.shape[0]):
            px, py = strange[i, 0], strange[i, 1]
            away = math.sqrt(px * px + py * py)
            if (x * px + y * py) > away * (max(0.5 * (away - radius - gap), 0.0) + 1e-6):
                return False
    return True


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
def choose(
    v0: float,
    w0: float,
    pose: FloatArray,
    limits: FloatArray,
    safety: FloatArray,
    near: FloatArray,
    strange: FloatArray,
    time: FloatArray,
    x0: float,
    y0: float,
    spacing: float,
    lane_m: float,
    horizon_s: float,
    heading_cost: float,
    near_cost: float,
    soft_m: float,
    speeds: int,
    turns: int,
) -> tuple[float, float, int]:
    """The pair of speed and turn rate within reach that leads on best, of those that can stop in time.

    Parameters
    ----------
    limits
        Top speed, acceleration, deceleration, top turn rate, turn acceleration, period of the decision.
    safety
        Reaction time, radius, margin, gap; see ``stop_is_clear``.
    time
        Time to go (rows, columns), infinite where no place is.
    lane_m
        The point so far to the left of the robot follows the field: the robot keeps to the right of it.

    Returns
    -------
    v, w, status
        HELD where nothing but standing or turning was clear.
    """
    top, acceleration, deceleration, top_turn, turn_acceleration, period = (
        limits[0],
        limits[1],
        limits[2],
        limits[3],
        limits[4],
        limits[5],
    )
    reaction, radius, margin, gap = safety[0], safety[1], safety[2], safety[3]
    low_v, high_v = max(0.0, v0 - deceleration * period), min(top, v0 + acceleration * period)
    low_w, high_w = (
        max(-top_turn, w0 - turn_acceleration * period),
        min(top_turn, w0 + turn_acceleration * period),
    )
    best, best_v, best_w, status = np.inf, 0.0, 0.0, HELD
    # What no braking from here can come near is not asked about.
    longest = high_v * reaction + 0.5 * high_v * high_v / deceleration
    hard = within(near, longest + radius + margin)
    moving = within(strange, 2.0 * longest + radius + gap)
    beside = within(near, high_v * horizon_s + radius + soft_m)
    cp, sp = math.cos(pose[2]), math.sin(pose[2])
    for i in range(speeds):
        v = low_v + (high_v - low_v) * i / (speeds - 1)
        for j in range(turns):
            w = low_w + (high_w - low_w) * j / (turns - 1)
            # Until it has come to v it drives on at what it has.
            if not stop_is_clear(
                max(v, 0.5 * (v + v0)), w, reaction, deceleration, radius, margin, hard, moving, gap
            ):
                continue
            x, y, theta = exact_arc(0.0, 0.0, 0.0, v * horizon_s, w * horizon_s)
            least = (soft_m + radius) * (soft_m + radius)
            for k in range(beside.shape[0]):
                dx, dy = beside[k, 0] - x, beside[k, 1] - y
                least = min(least, dx * dx + dy * dy)
            mx, my, heading = pose[0] + cp * x - sp * y, pose[1] + sp * x + cp * y, wrap(pose[2] + theta)
            # The field is followed by a point to the left.
            qx, qy = mx - lane_m * math.sin(heading), my + lane_m * math.cos(heading)
            cost = value_at(qx, qy, time, x0, y0, spacing, 2.0)
            if not cost < np.inf:
                cost = value_at(mx, my, time, x0, y0, spacing, 2.0) + 2.0
                if not cost < np.inf:
                    continue
            dx, dy = descent(qx, qy, time, x0, y0, spacing)
            if dx != 0.0 or dy != 0.0:
                cost += heading_cost * abs(wrap(math.atan2(dy, dx) - heading))
            lack = (soft_m + radius - math.sqrt(least)) / soft_m
            cost += near_cost * lack * lack
            if cost < best:
                best, best_v, best_w = cost, v, w
                status = FREE if v > 1e-3 else HELD
    return best_v, best_w, status
