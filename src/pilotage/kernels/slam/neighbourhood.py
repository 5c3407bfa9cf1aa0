"""Whether a scan without odometry lies better somewhere near where it was aligned.

Along a corridor it may have slid, and where the robot began to turn it may hang in a wrong fit. A constant
velocity tells how far off that may be: by some of its usual errors. Poses so far along the course that the
alignment holds least, turned either way, are asked of the map's raster of nearest points (Olson, Real-time
correlative scan matching, ICRA 2009); only a scan that fits poorly after that is left to a search.
"""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import TOO_FEW
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.local_map import MET, LocalMap, align_in_map, square_at
from pilotage.kernels.slam.placing import (
    POOR,
    POOR_AS_GUESSED,
    plausibility,
)
from pilotage.kernels.slam.track import Look

STEP_M, STEP_RAD = 0.05, 0.025
"""How far apart poses are that are looked at."""
WIDTH_M = 0.07
"""Distance from the map at which a point counts half."""
MOST_ASKED = 40
"""Of a scan of more points every second, third, ... is asked."""
MORE = 1.01
"""Score over that of the pose in the middle from which another one is worth aligning from."""
OFF_M, OFF_ERRORS, MOST_M = 0.1, 5.0, 0.5
"""How far is looked: so far, and so many usual errors of the guess farther."""
TURNED_RAD, POOR_TURNED_RAD = 0.05, 0.3
"""How far turned, and where the scan fits poorly."""
TRIES, NEAR_M = 2, 0.3
"""How often another place is aligned from, and the greatest distance of its first pairs."""
BETTER, BETTER_THAN_POOR, BETTER_BY = 1.03, 1.1, 0.01
"""By what a fit elsewhere must be better."""


@kernel
def _score(
    map_: LocalMap, source: FloatArray, every: int, x: float, y: float, theta: float, least: float
) -> float:
    """Sum over every so manieth point of a scan (K, 2 or more) of how near it is to the map, 1 at most each.

    What is certain to stay below ``least`` is not summed up to its end.
    """
    c, s = math.cos(theta), math.sin(theta)
    total, left = 0.0, (source.shape[0] + every - 1) // every
    for k in range(0, source.shape[0], every):
        qx = x + c * source[k, 0] - s * source[k, 1]
        qy = y + s * source[k, 0] + c * source[k, 1]
        u = square_at(map_, qx, qy) / (WIDTH_M * WIDTH_M)
        total += 1.0 / (1.0 + u)
        left -= 1
        if total + left <= least:
            return total
    return total


@kernel
def weak_course(hessian: FloatArray) -> tuple[float, float]:
    """Unit vector along which an alignment's Hessian (3, 3) holds a position least, its turn being free."""
    t = max(hessian[2, 2], 1e-12)
    a = hessian[0, 0] - hessian[0, 2] * hessian[0, 2] / t
    b = hessian[0, 1] - hessian[0, 2] * hessian[1, 2] / t
    d = hessian[1, 1] - hessian[1, 2] * hessian[1, 2] / t
    strong = 0.5 * math.atan2(2.0 * b, a - d)
    return -math.sin(strong), math.cos(strong)


@kernel
def best_near(
    map_: LocalMap,
    source: FloatArray,
    pose: FloatArray,
    course: tuple[float, float],
    half_m: float,
    half_rad: float,
) -> tuple[FloatArray, bool]:
    """Look for a better pose (3,) along a course and turned, and tell whether there is one.

    Parameters
    ----------
    source
        (K, 2 or more) points in the moving frame.
    half_m, half_rad
        How far from ``pose`` is looked.
    """
    every = max(1, source.shape[0] // MOST_ASKED)
    least = MORE * _score(map_, source, every, pose[0], pose[1], pose[2], -1.0)
    best, found = pose.copy(), False
    shifts, turns = math.ceil(half_m / STEP_M), math.ceil(half_rad / STEP_RAD)
    for a in range(-turns, turns + 1):
        theta = pose[2] + a * STEP_RAD
        for k in range(-shifts, shifts + 1):
            x, y = pose[0] + k * STEP_M * course[0], pose[1] + k * STEP_M * course[1]
            score = _score(map_, source, every, x, y, theta, least)
            if score > least:
                least, found = score, True
                best[0], best[1], best[2] = x, y, theta
    return best, found


@kernel
def is_best_near(
    source: FloatArray,
    last: FloatArray,
    motions: FloatArray,
    error: float,
    usual: float,
    map_: LocalMap,
    out: Look,
) -> bool:
    """Move ``out`` of ``placed`` to a better place nearby; tell whether there is no doubt of it then.

    Parameters
    ----------
    source, last, error, usual, map_
        As in ``placed``.
    motions
        (G, 3) the credible guesses.
    """
    told = out.told
    if told[0] < 0.0:
        return False
    for _ in range(TRIES):
        poor = told[0] < POOR * usual
        half_m = min(OFF_M + OFF_ERRORS * error, MOST_M)
        turned = POOR_TURNED_RAD if poor else TURNED_RAD
        start, found = best_near(map_, source, out.pose, weak_course(out.hessian), half_m, turned)
        if not found:
            break
        pose, system, fit, status = align_in_map(map_, source, start, NEAR_M, out.pose)
        if status in (TOO_FEW, MET):
            break
        share, off = plausibility(between(last, pose), motions, error, False)
        value = share * fit[1] / source.shape[0]
        if value <= (BETTER_THAN_POOR if poor else BETTER) * told[0] + BETTER_BY:
            break
        told[0], told[1], told[2], told[3] = value, off, fit[0], fit[1]
        pose[2] -= 2.0 * math.pi * math.floor(pose[2] / (2.0 * math.pi) + 0.5)
        out.pose[:], out.hessian[:], out.start[:] = pose, system, start
    return bool(told[0] >= POOR_AS_GUESSED * usual)
