"""Which cells of a floor a laser sees from a pose, and when each was seen last."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray
from pilotage.kernels.geometry.motion import TWO_PI
from pilotage.kernels.jit import kernel
from pilotage.kernels.scans.rays import fan_ranges


@kernel
def mark_seen(
    x: float,
    y: float,
    theta: float,
    half_view: float,
    reach: float,
    points: FloatArray,
    beams: int,
    segments: FloatArray,
    circles: FloatArray,
    seen: BoolArray,
) -> None:
    """Set ``seen`` (M,) where a point (M, 2) is in view from a pose.

    A point counts where both beams beside its bearing, of ``beams`` around the pose, reach at least as far
    as it lies, so that nothing is called seen through a gap between walls; a point within some ``reach *
    TWO_PI / beams`` of an edge may be missed.

    Parameters
    ----------
    half_view
        Half the field of view, rad; pi sees all around.
    """
    ranges = fan_ranges(x, y, 0.0, TWO_PI / beams, beams, reach, segments, circles)
    per_step = beams / TWO_PI
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        if abs(dx) > reach or abs(dy) > reach:
            continue
        away = math.hypot(dx, dy)
        if away > reach:
            continue
        bearing = math.atan2(dy, dx)
        if half_view < math.pi and away > 0.0:
            turned = (bearing - theta + math.pi) % TWO_PI - math.pi
            if abs(turned) > half_view:
                continue
        place = (bearing % TWO_PI) * per_step
        low = int(place) % beams
        if away <= min(ranges[low], ranges[(low + 1) % beams]):
            seen[k] = True


@kernel
def seen_from(
    places: FloatArray,
    reach: float,
    points: FloatArray,
    beams: int,
    segments: FloatArray,
    circles: FloatArray,
) -> BoolArray:
    """(P, M) which points (M, 2) are in view, all around, from which places (P, 2)."""
    out = np.zeros((places.shape[0], points.shape[0]), np.bool_)
    for p in range(places.shape[0]):
        mark_seen(places[p, 0], places[p, 1], 0.0, math.pi, reach, points, beams, segments, circles, out[p])
    return out


@kernel
def last_seen(
    times: FloatArray,
    poses: FloatArray,
    half_view: float,
    reach: float,
    points: FloatArray,
    beams: int,
    segments: FloatArray,
    circles: FloatArray,
    windows: FloatArray,
    begin: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Ages of points over a run of several robots.

    Parameters
    ----------
    times
        (T,) s, ascending; all points count as seen at the first.
    poses
        (T, N, 3) of the lasers; a row of nan sees nothing (a robot that failed).
    windows
        (W,) s.
    begin
        First step that counts (warm-up).

    Returns
    -------
    last
        (M,) when each point was seen last.
    mean, worst
        (M,) s age over the steps from ``begin`` on.
    share
        (T, W) share of the points seen within the last window.
    """
    steps, count = times.shape[0], points.shape[0]
    last = np.full(count, times[0])
    total = np.zeros(count)
    worst = np.zeros(count)
    share = np.zeros((steps, windows.shape[0]))
    seen = np.zeros(count, np.bool_)
    ever = np.zeros(count, np.bool_)
    for t in range(steps):
        seen[:] = False
        for n in range(poses.shape[1]):
            if not math.isnan(poses[t, n, 0]):
                mark_seen(
                    poses[t, n, 0], poses[t, n, 1], poses[t, n, 2], half_view, reach, points, beams,
                    segments, circles, seen,
                )  # fmt: skip
        for k in range(count):
            # A point is oldest just before it is seen again.
            if t >= begin:
                worst[k] = max(worst[k], times[t] - last[k])
            if seen[k]:
                last[k] = times[t]
                ever[k] = True
            if t >= begin:
                total[k] += times[t] - last[k]
            if ever[k]:
                for w in range(windows.shape[0]):
                    if times[t] - last[k] <= windows[w]:
                        share[t, w] += 1.0
    return last, total / max(1, steps - begin), worst, share / max(1, count)
