"""What range sensors would read among segments and circles: laser fans and cones."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.jit import kernel

Fan: TypeAlias = tuple[float, float, FloatArray, FloatArray, float]
"""Beam k looks along ``first + k * step`` in the sensor's frame: first, step, cosines and sines of the
directions from the first one (beams,), and the reach."""
BEAM_SLACK = 1e-9
"""In beams, added at both ends of an obstacle, so that no beam slips between two walls that meet."""

SIGHT_MARGIN_M = 1e-6
"""A line of sight ends this far before its target: a beacon on a wall is not hidden by that wall."""


@kernel
def fan_ranges(
    x: float,
    y: float,
    first: float,
    step: float,
    beams: int,
    max_range: float,
    segments: FloatArray,
    circles: FloatArray,
) -> FloatArray:
    """Ranges (beams,) of a fan whose beam k looks along ``first + k * step`` in the map frame.

    ``max_range`` where nothing is hit; all 0 inside a circle.
    """
    cosines = np.empty(beams)
    sines = np.empty(beams)
    # Rotating by a constant step costs two products a beam; the drift over a fan stays below 1e-12.
    c, s = 1.0, 0.0
    cs, ss = math.cos(step), math.sin(step)
    for k in range(beams):
        cosines[k] = c
        sines[k] = s
        c, s = c * cs - s * ss, s * cs + c * ss
    ranges = np.full(beams, max_range)
    narrow_fan(ranges, x, y, first, (0.0, step, cosines, sines, max_range), segments, circles)
    return ranges


@kernel
def _beams_between(first: float, last: float, beams: int) -> tuple[int, int]:
    """The range of beams from one place in beams to another; empty where either is no number.

    Compared before they are cast: a cast of what is infinite or no number may be any index.
    """
    if not (first - BEAM_SLACK < beams and last + BEAM_SLACK >= 0.0):
        return 0, 0
    low = math.ceil(first - BEAM_SLACK) if first > BEAM_SLACK else 0
    high = math.floor(last + BEAM_SLACK) + 1 if last + BEAM_SLACK < beams else beams
    return low, high


@kernel
def narrow_fan(
    ranges: FloatArray, x: float, y: float, theta: float, fan: Fan, segments: FloatArray, circles: FloatArray
) -> None:
    """Shorten the ``ranges`` of a fan, in place, where segments and circles are nearer.

    Each obstacle is met only by the beams inside the angle it subtends, so the work is the number of
    (beam, obstacle) pairs that can meet at all. Obstacles are turned into the fan's own frame, in which the
    first beam's direction is 0 and the table never changes.
    """
    first, step, cosines, sines, max_range = fan
    theta += first
    beams = cosines.shape[0]
    per_step = 1.0 / (step if beams > 1 else TWO_PI)
    ct, st = math.cos(theta), math.sin(theta)
    for i in range(segments.shape[0]):
        px, py = segments[i, 0] - x, segments[i, 1] - y
        qx, qy = segments[i, 2] - x, segments[i, 3] - y
        cross = px * qy - py * qx
        lx, ly = qx - px, qy - py
        # Seen edge-on (or of no length) no beam meets it in more than a point; its line may be out of reach.
        if cross == 0.0 or cross * cross >= max_range * max_range * (lx * lx + ly * ly):
            continue
        if cross < 0.0:  # order the ends counter-clockwise
            px, py, qx, qy, cross = qx, qy, px, py, -cross
        ax, ay = ct * px + st * py, ct * py - st * px
        bx, by = ct * qx + st * qy, ct * qy - st * qx
        ex, ey = bx - ax, by - ay
        width = math.atan2(cross, ax * bx + ay * by)  # in (0, pi)
        offset = math.atan2(ay, ax)
        if offset < 0.0:
            offset += TWO_PI
        # The second turn serves obstacles that begin before the first beam.
        for turn in range(2):
            start = offset - turn * TWO_PI
            low, high = _beams_between(start * per_step, (start + width) * per_step, beams)
            for k in range(low, high):
                # On the line a + u e: range = (a x e) / (d x e), and a x e = a x b.
                denominator = cosines[k] * ey - sines[k] * ex
                ranges[k] = min(ranges[k], cross / denominator) if denominator > 0.0 else ranges[k]
    for i in range(circles.shape[0]):
        px, py, radius = circles[i, 0] - x, circles[i, 1] - y, circles[i, 2]
        cx, cy = ct * px + st * py, ct * py - st * px
        centre = math.hypot(cx, cy)
        if centre <= radius:
            ranges[:] = 0.0
            return
        half = math.asin(radius / centre)
        offset = (math.atan2(cy, cx) - half) % TWO_PI
        for turn in range(2):
            start = offset - turn * TWO_PI
            low, high = _beams_between(start * per_step, (start + 2.0 * half) * per_step, beams)
            for k in range(low, high):
                along = cx * cosines[k] + cy * sines[k]
                across = cx * sines[k] - cy * cosines[k]
                rest = max(radius * radius - across * across, 0.0)
                ranges[k] = min(ranges[k], along - math.sqrt(rest))


@kernel
def cone_range(
    x: float, y: float, theta: float, half_width: float, segments: FloatArray, circles: FloatArray
) -> float:
    """Distance from the apex to the nearest of (S, 4) segments and (C, 3) circles in the cone; inf for none.

    The cone spans theta +- half_width, half_width below pi/2.
    """
    lx, ly = math.cos(theta + half_width), math.sin(theta + half_width)
    rx, ry = math.cos(theta - half_width), math.sin(theta - half_width)
    best = math.inf
    for i in range(segments.shape[0]):
        ax, ay = segments[i, 0] - x, segments[i, 1] - y
        dx, dy = segments[i, 2] - segments[i, 0], segments[i, 3] - segments[i, 1]
        # Inside the cone: left of its right edge and right of its left edge. Clip a + t d to both.
        t0, t1 = 0.0, 1.0
        for edge in range(2):
            if edge == 0:
                value, slope = rx * ay - ry * ax, rx * dy - ry * dx
            else:
                value, slope = ax * ly - ay * lx, dx * ly - dy * lx
            if slope > 0.0:
                t0 = max(t0, -value / slope)
            elif slope < 0.0:
                t1 = min(t1, -value / slope)
            elif value < 0.0:
                t1 = -1.0
        if t0 > t1:
            continue
        length2 = dx * dx + dy * dy
        t = t0
        if length2 > 0.0:
            t = min(t1, max(t0, -(ax * dx + ay * dy) / length2))
        best = min(best, math.hypot(ax + t * dx, ay + t * dy))
    for i in range(circles.shape[0]):
        cx, cy, radius = circles[i, 0] - x, circles[i, 1] - y, circles[i, 2]
        inside = rx * cy - ry * cx >= 0.0 and cx * ly - cy * lx >= 0.0
        if inside:
            best = min(best, max(math.hypot(cx, cy) - radius, 0.0))
            continue
        # Its nearest point inside the cone, if any, lies on one of the cone's edges.
        for edge in range(2):
            ex, ey = (lx, ly) if edge == 0 else (rx, ry)
            along = cx * ex + cy * ey
            across = cx * ey - cy * ex
            rest = radius * radius - across * across
            if along > 0.0 and rest >= 0.0:
                best = min(best, max(along - math.sqrt(rest), 0.0))
    return best
