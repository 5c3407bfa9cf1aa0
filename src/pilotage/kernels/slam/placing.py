"""A scan placed by whichever of several guesses of its motion it fits best."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.frames import between, composed

START_REACH_M, REACH_M, SCALE_M, ITERATIONS = 0.4, 0.2, 0.05, 25
CREDIBLE, CREDIBLE_OFF = 3.0, 0.003
"""A guess is credible whose mean error is within this factor of the least, and this more."""
GOOD = 0.92
"""Fit over its running mean from which no further guess is tried."""
SPLIT = 0.1
"""Guesses farther apart than this are all tried, unless the scan lies where a trusted odometry guessed it:
where the robot begins to turn, the first one fits nowhere or, worse, somewhere else."""
OFF_M, OFF_ERRORS = 0.05, 10.0
"""A match this far from all guesses, and so many of their usual errors more, counts half."""
BETTER, BETTER_BY = 1.03, 0.005
MEMORY, MOST_OFF = 0.02, 1.0
"""Weight of the newest error in the running mean (fifty scans count), and the greatest error."""


@kernel
def distance(a: FloatArray, b: FloatArray) -> float:
    """How far two motions (3,) are apart, a radian counting as half a metre."""
    dx, dy = a[0] - b[0], a[1] - b[1]
    turn: float = abs(a[2] - b[2])
    return math.sqrt(dx * dx + dy * dy) + 0.5 * turn


@kernel
def readings_differ(
    at_scans: FloatArray, readings: FloatArray, first: IntArray, end: IntArray, least_m: float
) -> BoolArray:
    """(N,) whether one of the readings ``first`` to ``end`` is ``least_m`` from where a scan (N, 3) was."""
    out = np.zeros(at_scans.shape[0], np.bool_)
    for k in range(at_scans.shape[0]):
        for i in range(first[k], end[k]):
            dx, dy = readings[i, 0] - at_scans[k, 0], readings[i, 1] - at_scans[k, 1]
            turn = readings[i, 2] - at_scans[k, 2]
            turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
            out[k] = out[k] or math.sqrt(dx * dx + dy * dy) + 0.5 * abs(turn) > least_m
    return out


@kernel
def guessed_motions(
    errors: FloatArray, velocity: FloatArray, step: FloatArray, led: bool, dt_s: float
) -> tuple[FloatArray, int]:
    """Motions (G, 3) that a scan may have made, the most trusted first, and how many of them are credible.

    Parameters
    ----------
    errors
        (3,) running means of how far the odometry, a constant velocity and standing still were off.
    velocity
        (3,) in the scanner's frame, a second.
    step, led
        (3,) by the odometry, and whether there is one.
    """
    motions = np.zeros((3, 3))
    # A velocity of long ago is none.
    same = dt_s if dt_s < 1.5 else 0.0
    most = CREDIBLE * errors.min() + CREDIBLE_OFF
    count = credible = 0
    for k in np.argsort(errors, kind="mergesort"):
        if k == 0 and not led:
            continue
        for a in range(3):
            motions[count, a] = step[a] if k == 0 else same * velocity[a] if k == 1 else 0.0
        count += 1
        credible += errors[k] <= most
    return motions[:count], credible


@kernel
def learn_motion(
    errors: FloatArray, velocity: FloatArray, step: FloatArray, led: bool, motion: FloatArray, dt_s: float
) -> None:
    """Bring errors and velocity of ``guessed_motions`` up to date by a motion (3,) that a scan told."""
    standing = np.zeros(3)
    guesses = (step if led else standing, velocity * dt_s, standing)
    for k in range(3):
        errors[k] += MEMORY * (min(MOST_OFF, distance(guesses[k], motion)) - errors[k])
    for a in range(3):
        velocity[a] = 0.5 * velocity[a] + 0.5 * motion[a] / max(dt_s, 0.05)


@kernel
def plausibility(motion: FloatArray, guesses: FloatArray, error: float) -> tuple[float, float]:
    """What a fit counts by how far its motion (3,) is from all guesses (G, 3), and that distance.

    ``error`` is the usual one of the most trusted guess.
    """
    off = math.inf
    for k in range(guesses.shape[0]):
        off = min(off, distance(motion, guesses[k]))
    u = off / (OFF_M + OFF_ERRORS * error)
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
    prior: FloatArray,
    box: FloatArray,
    starts: IntArray,
    points: FloatArray,
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
    prior, box, starts, points
        As in ``align``.

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
    best, hessian, start = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    for k in range(count + others.shape[0]):
        if told[0] > GOOD * usual and (k >= count or not split or (led and as_guessed)):
            break
        motion = motions[k] if k < count else others[k - count]
        began = composed(last, motion)
        pose, system, fit, status = align(
            source, began, prior, START_REACH_M, REACH_M, SCALE_M, ITERATIONS, box, starts, points
        )
        if status == TOO_FEW:
            continue
        share, off = plausibility(between(last, pose), near, error)
        value = share * fit[1] / source.shape[0]
        if told[0] < 0.0 or value > BETTER * told[0] + BETTER_BY:
            told[0], told[1], told[2], told[3] = value, off, fit[0], fit[1]
            best, hessian, start = pose, system, began
            as_guessed = distance(between(last, best), motions[0]) < CREDIBLE * error + CREDIBLE_OFF
    best[2] -= 2.0 * math.pi * math.floor(best[2] / (2.0 * math.pi) + 0.5)
    return best, hessian, start, told, split
