"""A scan placed by whichever of several guesses of its motion it fits best."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import TOO_FEW
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.local_map import MET, LocalMap, align_in_map

START_REACH_M = 0.4
CREDIBLE, CREDIBLE_OFF = 3.0, 0.003
"""A guess is credible whose mean error is within this factor of the least, and this more."""
POOR, POOR_AS_GUESSED = 0.75, 0.6
"""Fit over its running mean below which there is a search, and below which there is one where the scan lies
within the usual error of what a trusted guess has, or where its neighbourhood was looked at."""
GOOD = 0.92
"""Fit over its running mean from which no further guess is tried."""
SPLIT = 0.1
"""Guesses farther apart than this are all tried, unless the scan lies where a trusted odometry guessed it:
where the robot begins to turn, the first one fits nowhere or, worse, somewhere else."""
OFF_M, OFF_ERRORS = 0.05, 10.0
LONG_M, OFF_SHARE, MOST_MORE_M = 0.5, 0.2, 0.5
"""A match counts half that is this far from all guesses, and so many of their usual errors farther. From
those of an odometry also farther by this share of a motion longer than LONG_M (where a recording begins no
error is usual yet), but by MOST_MORE_M at most: a corridor's walls fit a scan a metre off as well."""
BETTER, BETTER_BY = 1.03, 0.005
LONG_AGO_S = 1.5
"""Between scans that are farther apart in time no velocity is kept."""
MEMORY, MOST_OFF = 0.02, 1.0
"""Weight of the newest error in the running mean (fifty scans count), and the greatest error."""


@kernel
def distance(a: FloatArray, b: FloatArray) -> float:
    """How far two motions (3,) are apart, a radian counting as half a metre."""
    dx, dy = a[0] - b[0], a[1] - b[1]
    turn: float = abs(a[2] - b[2])
    return math.sqrt(dx * dx + dy * dy) + 0.5 * turn


@kernel
def _distinct(
    at: FloatArray, readings: FloatArray, first: int, end: int, least_m: float, kept: FloatArray
) -> int:
    """Fill ``kept`` (K, 3) with readings ``least_m`` from ``at`` (3,) and from one another; how many."""
    count = 0
    for i in range(first, end):
        new = True
        for k in range(-1, count):
            other = at if k < 0 else kept[k]
            turn = readings[i, 2] - other[2]
            turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
            dx, dy = readings[i, 0] - other[0], readings[i, 1] - other[1]
            new = new and math.sqrt(dx * dx + dy * dy) + 0.5 * abs(turn) > least_m
        if new:
            kept[count] = readings[i]
            count += 1
    return count


@kernel
def distinct_readings(
    at_scans: FloatArray, readings: FloatArray, first: IntArray, end: IntArray, least_m: float
) -> tuple[IntArray, FloatArray]:
    """Where else each scan may have been by the odometry.

    Parameters
    ----------
    at_scans
        (N, 3) where the odometry has the scans.
    readings, first, end
        (R, 3) all that it told; those from ``first`` up to ``end`` (N,) are asked for each scan.
    least_m
        How far they must be from there and from one another, a radian counting as half a metre.

    Returns
    -------
    starts, others
        (N + 1,) and (M, 3): those of scan k are ``others[starts[k] : starts[k + 1]]``.
    """
    count, most = at_scans.shape[0], 0
    for k in range(count):
        most = max(most, end[k] - first[k])
    kept, starts = np.empty((most, 3)), np.zeros(count + 1, np.int64)
    for k in range(count):
        starts[k + 1] = starts[k] + _distinct(at_scans[k], readings, first[k], end[k], least_m, kept)
    others = np.empty((starts[count], 3))
    for k in range(count):
        if starts[k + 1] > starts[k]:
            _distinct(at_scans[k], readings, first[k], end[k], least_m, others[starts[k] : starts[k + 1]])
    return starts, others


@kernel
def _kept_s(dt_s: float) -> float:
    """For how long a velocity is kept to: one of long ago is none."""
    return dt_s if dt_s < LONG_AGO_S else 0.0


@kernel
def guessed_motions(
    errors: FloatArray, velocity: FloatArray, step: FloatArray, led: bool, dt_s: float
) -> tuple[FloatArray, int]:
    """Motions (G, 3) that a scan may have made, the most trusted first, and how many of them are credible.

    One that denies a long motion of the odometry is thought to be off by a share of that at least: in the
    beginning, when nothing has been right or wrong yet, the robot does not stand while its wheels turn.

    Parameters
    ----------
    errors
        (3,) running means of how far the odometry, a constant velocity and standing still were off.
    velocity
        (3,) in the scanner's frame, a second.
    step, led
        (3,) by the odometry, and whether there is one.
    """
    told = np.zeros((3, 3))
    told[0], told[1] = step, _kept_s(dt_s) * velocity
    usual = errors.copy()
    if led:
        for k in range(1, 3):
            usual[k] = max(usual[k], OFF_SHARE * (distance(told[0], told[k]) - LONG_M))
    motions = np.zeros((3, 3))
    most = CREDIBLE * usual.min() + CREDIBLE_OFF
    count = credible = 0
    for k in np.argsort(usual, kind="mergesort"):
        if k == 0 and not led:
            continue
        motions[count] = told[k]
        count += 1
        credible += usual[k] <= most
    return motions[:count], credible


@kernel
def learn_motion(
    errors: FloatArray, velocity: FloatArray, step: FloatArray, led: bool, motion: FloatArray, dt_s: float
) -> None:
    """Bring errors and velocity of ``guessed_motions`` up to date by a motion (3,) that a scan told."""
    standing = np.zeros(3)
    guesses = (step if led else standing, velocity * _kept_s(dt_s), standing)
    for k in range(3):
        errors[k] += MEMORY * (min(MOST_OFF, distance(guesses[k], motion)) - errors[k])
    for a in range(3):
        velocity[a] = 0.5 * velocity[a] + 0.5 * motion[a] / max(dt_s, 0.05)


@kernel
def plausibility(
    motion: FloatArray, guesses: FloatArray, error: float, by_odometry: bool
) -> tuple[float, float]:
    """What a fit counts by how far its motion (3,) is from all guesses (G, 3), and that distance.

    ``error`` is the usual one of the most trusted guess, and ``by_odometry`` whether that is the odometry's.
    """
    off, size = math.inf, 0.0
    standing = np.zeros(3)
    for k in range(guesses.shape[0]):
        apart = distance(motion, guesses[k])
        if apart < off:
            off, size = apart, distance(guesses[k], standing)
    more = OFF_ERRORS * error
    if by_odometry:
        more = min(more + OFF_SHARE * max(0.0, size - LONG_M), MOST_MORE_M)
    u = off / (OFF_M + more)
    return 1.0 / (1.0 + u * u), off


@kernel
def placed(
    source: FloatArray,
    last: FloatArray,
    motions: FloatArray,
    credible: int,
    led: bool,
    others: FloatArray,
    error: float,
    usual: float,
    alone: bool,
    map_: LocalMap,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, bool]:
    """Align a scan from one guess after the other until it fits as well as usual.

    Parameters
    ----------
    source
        (K, 6) of ``scan_lines``.
    last
        (3,) pose of the scan before.
    motions, credible
        Of ``guessed_motions``.
    led
        Whether the most trusted one is the odometry's.
    others
        (M, 3) what else the odometry may have meant: tried last.
    error, usual
        Usual error of the most trusted guess, and usual value of a fit.
    alone
        Whether there is no odometry: then one good fit is enough, for its neighbourhood is looked at later.
    map_
        As in ``align_in_map``.

    Returns
    -------
    pose, hessian, start
        (3,), (3, 3) and (3,) of the best alignment.
    told
        (4,) its value (weights over points, less where it is far from all guesses; -1: nothing fits), its
        distance from the nearest credible guess, root mean square of its residuals and sum of its weights.
    split
        Whether the guesses are far apart.
    """
    count = motions.shape[0]
    near = np.concatenate((motions[:credible], others))
    split = as_guessed = False
    for k in range(1, count):
        split = split or distance(motions[0], motions[k]) > SPLIT
    told = np.array([-1.0, 0.0, 0.0, 0.0])
    known = np.full(3, np.inf)
    best, hessian, start = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    for k in range(count + others.shape[0]):
        if told[0] > GOOD * usual and (k >= count or not split or alone or (led and as_guessed)):
            break
        motion = motions[k] if k < count else others[k - count]
        began = composed(last, motion)
        pose, system, fit, status = align_in_map(map_, source, began, START_REACH_M, known)
        if status in (TOO_FEW, MET):
            continue
        share, off = plausibility(between(last, pose), near, error, led)
        value = share * fit[1] / source.shape[0]
        if told[0] < 0.0 or value > BETTER * told[0] + BETTER_BY:
            told[0], told[1], told[2], told[3] = value, off, fit[0], fit[1]
            best, hessian, start, known = pose, system, began, pose
            as_guessed = distance(between(last, best), motions[0]) < CREDIBLE * error + CREDIBLE_OFF
    best[2] -= 2.0 * math.pi * math.floor(best[2] / (2.0 * math.pi) + 0.5)
    return best, hessian, start, told, split
