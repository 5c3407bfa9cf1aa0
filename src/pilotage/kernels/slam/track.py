"""What following a track of scans goes by: where it has come to, what was made of a scan, and keyframes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.local_map import LocalMap
from pilotage.kernels.slam.movers import Views
from pilotage.kernels.slam.wheels import Wheels


class Track(NamedTuple):
    """What is known where a track has come to, brought up to date scan by scan.

    Attributes
    ----------
    pose, keyframe
        (3,) of the last scan and of the last keyframe.
    errors, velocity
        Of ``guessed_motions``.
    usual
        (2,) running means of a fit's value and of its residuals.
    slip, held
        (3, 3) of ``add_slip`` since the last keyframe.
    crowded
        (1,) in how many scans so much seemed to move that they were left whole.
    residuals
        (2,) sum of the residuals' root mean squares of all scans, and how many there were.
    since
        (1,) how many scans were placed since the last keyframe.
    moving
        (2,) which share of the scan that was placed last, and of the one looked at, seemed to have come where
        it stands; not a number where that was not asked.
    fitted
        (1,) the last placed scan's fit over its running mean.
    wheels
        What the odometry is always off by.
    """

    pose: FloatArray
    keyframe: FloatArray
    errors: FloatArray
    velocity: FloatArray
    usual: FloatArray
    slip: FloatArray
    held: FloatArray
    crowded: IntArray
    residuals: FloatArray
    since: IntArray
    moving: FloatArray
    fitted: FloatArray
    wheels: Wheels


class Look(NamedTuple):
    """What the guesses alone made of a scan.

    Attributes
    ----------
    motions, counts
        (3, 3) and (3,): the guesses of ``guessed_motions``, how many, how many credible, and whether they are
        far apart.
    pose, hessian, start, told
        Of ``placed``.
    """

    motions: FloatArray
    counts: IntArray
    pose: FloatArray
    hessian: FloatArray
    start: FloatArray
    told: FloatArray


class Tracked(NamedTuple):
    """A track, what its last keyframes saw, as points and as beams, and what was made of the last scan."""

    track: Track
    map_: LocalMap
    views: Views
    out: Look


class Keyframes(NamedTuple):
    """Scans that became keyframes and were not fetched yet.

    Attributes
    ----------
    scans, hessians, slips
        (C,), (C, 3, 3) of their alignments, and (C, 3, 3) of what may have slipped since the one before.
    points, starts
        (M, 6) without people, one after the other, and (C + 1,) where each begins.
    added
        (1,) how many there are.
    """

    scans: IntArray
    hessians: FloatArray
    slips: FloatArray
    points: FloatArray
    starts: IntArray
    added: IntArray


def empty_keyframes(count: int, beams: int) -> Keyframes:
    """Room for so many scans of so many points."""
    return Keyframes(
        np.zeros(count, np.int64),
        np.zeros((count, 3, 3)),
        np.zeros((count, 3, 3)),
        np.zeros((count * beams, 6)),
        np.zeros(count + 1, np.int64),
        np.zeros(1, np.int64),
    )


class Recording(NamedTuple):
    """Scans of a log one after the other, and the odometry at them.

    Attributes
    ----------
    ranges_m, beams, first_rad, step_rad
        (N, B), (N,), (N,), (N,) as in ``LaserLog``.
    dt_s
        (N,) smoothed time since the scan before.
    at_scans, starts, others
        (N, 3) where the odometry has the scanner, and of ``distinct_readings``; (0, 3) where there is none.
    anchor
        (3,) from where the next motion is counted.
    """

    ranges_m: FloatArray
    beams: IntArray
    first_rad: FloatArray
    step_rad: FloatArray
    dt_s: FloatArray
    at_scans: FloatArray
    starts: IntArray
    others: FloatArray
    anchor: FloatArray


@kernel
def has_room(beams: int, map_: LocalMap, views: Views, kept: Keyframes) -> bool:
    """Whether a scan of so many points may become a keyframe."""
    number = kept.added[0]
    fetched: bool = number < kept.scans.shape[0] and kept.starts[number] + beams <= kept.points.shape[0]
    return bool(fetched and map_.counts[0] + beams <= map_.points.shape[0] and beams < views.polar.shape[1])
