"""Points of a scan that stand where earlier scans looked through: somebody has come there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.local_map import LocalMap, looked_up

NEAREST_M, GAP_RAD, LEAST_BEAMS = 0.3, 0.06, 8
"""Nearer points are the robot's own; beams farther apart leave a gap; a scan of fewer tells nothing."""

MARGIN_M, BESIDE_M, FARTHEST_M = 0.3, 0.2, 8.0
"""How far beams must have gone on behind a point, how wide around it, and how far away it may be."""
VIEWS, EVERY, VOTES = 15, 3, 2
"""Of the last keyframes every third is asked, and so many must have looked through a point."""
MOST = 0.4
"""Share of a scan that may be movers: where more seems to move, the guess is wrong and not the world."""
KNOWN_M = 0.1
"""A point so near to one of the map's has not come there."""


@kernel
def bearing_of(x: float, y: float) -> float:
    """Direction of a vector to 1.2e-5 rad, in a fifth of the time of the exact one.

    Hastings' polynomial (Abramowitz and Stegun 4.4.49).
    """
    ax, ay = abs(x), abs(y)
    large = max(ax, ay)
    t = min(ax, ay) / large if large > 0.0 else 0.0
    s = t * t
    angle = t * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))))
    if ay > ax:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return angle if y >= 0.0 else -angle


@kernel
def polar(points: FloatArray) -> FloatArray:
    """(K, 2) bearing from that of the first, from 0 to two pi, and range of points (K, 2 or more).

    The last row, (0, 0), is the first one's bearing and a zero.
    """
    count = points.shape[0]
    out = np.zeros((count + 1, 2))
    first = bearing_of(points[0, 0], points[0, 1]) if count else 0.0
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        out[k, 0] = (bearing_of(x, y) - first) % (2.0 * math.pi)
        out[k, 1] = math.sqrt(x * x + y * y)
    out[count, 0] = first
    return out


@kernel
def _went_on(view: FloatArray, count: int, bearing: float, r: float) -> bool:
    """Whether all beams of a view that pass a place within ``BESIDE_M``, two at least on either side, did."""
    at = int(bearing / max(view[count - 1, 0], 1e-9) * (count - 1))
    at = min(max(at, 0), count)
    while at < count and view[at, 0] < bearing:
        at += 1
    while at > 0 and view[at - 1, 0] >= bearing:
        at -= 1
    if not 2 <= at <= count - 2:
        return False
    beside = BESIDE_M / r
    for step in (-1, 1):
        m, passed = at if step == 1 else at - 1, 0
        while 0 <= m < count:
            away = abs(view[m, 0] - bearing)
            if passed >= 2 and away > beside:
                break
            if not (view[m, 1] > r + MARGIN_M and away < beside + GAP_RAD):
                return False
            passed += 1
            m += step
        if passed < 2:
            return False
    return True


class Views(NamedTuple):
    """What the last keyframes saw, each written over the one ``VIEWS`` before it.

    Attributes
    ----------
    polar, sizes
        (VIEWS, M, 2) of ``polar``, in the order of the beams, and (VIEWS,) how many points each has.
    poses
        (VIEWS, 3) where they were taken.
    added
        (1,) how many were added in all.
    """

    polar: FloatArray
    sizes: IntArray
    poses: FloatArray
    added: IntArray


def empty_views(beams: int) -> Views:
    """Room for scans of so many points."""
    return Views(
        np.zeros((VIEWS, beams + 1, 2)),
        np.zeros(VIEWS, np.int64),
        np.zeros((VIEWS, 3)),
        np.zeros(1, np.int64),
    )


@kernel
def add_view(views: Views, cloud: FloatArray, pose: FloatArray) -> None:
    """Take in a keyframe's points (K, 2 or more), all of them, at a pose (3,)."""
    v = views.added[0] % VIEWS
    views.polar[v, : cloud.shape[0] + 1] = polar(cloud)
    views.sizes[v] = cloud.shape[0]
    views.poses[v] = pose
    views.added[0] += 1


@kernel
def seen_through(points: FloatArray, pose: FloatArray, known: BoolArray, views: Views) -> BoolArray:
    """Whether points (K, 2 or more) at a pose (3,) stand in what earlier scans saw empty.

    For an earlier scan a point does where all its beams that pass the point within ``BESIDE_M``, two at
    least on either side, went on for ``MARGIN_M`` and more. Beside a wall seen at a grazing angle some of
    them did not; beams that hit nothing tell nothing. ``known`` (K,) points are not asked for.
    """
    out = np.zeros(points.shape[0], np.bool_)
    told = np.zeros(points.shape[0], np.int64)
    open_ = np.flatnonzero(~known)
    asked = -(-min(views.added[0], VIEWS) // EVERY)
    for m in range(asked):
        v = (views.added[0] - 1 - m * EVERY) % VIEWS
        view, count = views.polar[v], views.sizes[v]
        if count < LEAST_BEAMS:
            continue
        off = between(views.poses[v], pose)
        c, s = math.cos(off[2]), math.sin(off[2])
        for k in open_:
            # A point that the views that are left could not vote out any more is not asked for.
            if out[k] or told[k] + asked - m < VOTES:
                continue
            x = off[0] + c * points[k, 0] - s * points[k, 1]
            y = off[1] + s * points[k, 0] + c * points[k, 1]
            square = x * x + y * y
            if square > FARTHEST_M * FARTHEST_M or square < NEAREST_M * NEAREST_M:
                continue
            bearing = bearing_of(x, y) - view[count, 0]
            if bearing < 0.0:
                bearing += 2.0 * math.pi
            if _went_on(view, count, bearing, math.sqrt(square)):
                told[k] += 1
                out[k] = told[k] >= VOTES
    return out


@kernel
def looked_through(
    points: FloatArray, pose: FloatArray, known: FloatArray, at: FloatArray
) -> tuple[int, int]:
    """How many of an earlier scan's points (N, 2 or more) a scan (K, 2 or more) sees something behind.

    Both at their poses (3,). Nobody sees through a wall: many that do speak against where the scan lies.

    Returns
    -------
    That, and how many of the points lie between the scan's outer beams and are near enough to be told.
    """
    view, count = polar(points), points.shape[0]
    through = asked = 0
    if count < LEAST_BEAMS:
        return through, asked
    last = 0.0
    for k in range(count):
        last = max(last, view[k, 0])
    off = between(pose, at)
    c, s = math.cos(off[2]), math.sin(off[2])
    for k in range(known.shape[0]):
        x = off[0] + c * known[k, 0] - s * known[k, 1]
        y = off[1] + s * known[k, 0] + c * known[k, 1]
        square = x * x + y * y
        if square > FARTHEST_M * FARTHEST_M or square < NEAREST_M * NEAREST_M:
            continue
        bearing = (bearing_of(x, y) - view[count, 0]) % (2.0 * math.pi)
        if bearing <= last:
            asked += 1
            through += _went_on(view, count, bearing, math.sqrt(square))
    return through, asked


@kernel
def without_movers(
    points: FloatArray, pose: FloatArray, map_: LocalMap, views: Views
) -> tuple[IntArray, float]:
    """Rows (N,) of a scan's points (K, 2 or more) at about a pose (3,) that have not come there.

    Those where the map has a wall have not. Where ``MOST`` of the scan seem to move it is left whole. The
    second answer is the share that seems to.
    """
    paired = np.empty(points.shape[0], np.int64)
    looked_up(map_, points, pose[0], pose[1], pose[2], paired)
    known = np.zeros(points.shape[0], np.bool_)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for k in range(points.shape[0]):
        if paired[k] >= 0:
            dx = pose[0] + c * points[k, 0] - s * points[k, 1] - map_.points[paired[k], 0]
            dy = pose[1] + s * points[k, 0] + c * points[k, 1] - map_.points[paired[k], 1]
            known[k] = dx * dx + dy * dy < KNOWN_M * KNOWN_M
    moving = seen_through(points, pose, known, views)
    count = int(np.count_nonzero(moving))
    share = count / max(points.shape[0], 1)
    if count == 0 or share >= MOST:
        return np.arange(points.shape[0]), share
    return np.flatnonzero(~moving), share
