"""What an odometry is always off by, learnt from where scans were found to lie.

A body's wheels are never of the size that is told, nor of one size: motions are too long by one factor,
turns by another, and who drives straight seems to turn by so much a metre (Borenstein and Feng, 1996). These
three are found by least squares with a memory that fades. Motions between wrong stamps pass for motions that
are far too long: who is off by more than wheels are is not righted. An alignment is held a little by the
guess that it began from: some per cent of what an odometry is always off by would stay in the track, always
to one side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

FADING = 1.0 - 1.0 / 1000.0
"""What is left of a motion's weight after the next one: a floor, a load or a battery may change."""
STANDING_M = 1e-3
"""A shorter motion (a radian as half a metre) is none: who stands for long forgets nothing."""
MOTION_STD_M, TURN_STD_RAD = 0.015, 0.006
"""What a motion between two scans is known to."""
SCALE_STD, A_METRE_STD_RAD = 0.03, 0.03
"""What an odometry may be expected to be off by: its scales, and its turn a metre."""
CREDIBLE_STDS = 4.0
"""Who is off by more such standard deviations has no such wheels: stamps are wrong, nothing is righted."""
HELD = 0.1
"""Share of the weights of a scan's points that must hold it along its motion for that to be told."""
MOST_M, MOST_SHARE = 0.05, 0.2
"""Motions that are off by more than this, and this share of them, more tell of slips and of wrong stamps."""


class Wheels(NamedTuple):
    """What is known of an odometry.

    Attributes
    ----------
    off
        (3,) share by which it is to be lengthened, turn to be added a metre, share of a turn to be added.
    information, told
        (3, 3) and (3,) of the motions so far, in which the first is independent of the others.
    """

    off: FloatArray
    information: FloatArray
    told: FloatArray


def unknown_wheels() -> Wheels:
    """Nothing is known yet."""
    return Wheels(np.zeros(3), np.zeros((3, 3)), np.zeros(3))


@kernel
def righted(wheels: Wheels, step: FloatArray) -> FloatArray:
    """Motion (3,) of an odometry without what it is always off by."""
    longer = 1.0 + wheels.off[0]
    turn = step[2] * (1.0 + wheels.off[2]) + wheels.off[1] * step[0]
    return np.array([longer * step[0], longer * step[1], turn])


@kernel
def learn_wheels(wheels: Wheels, step: FloatArray, motion: FloatArray, held: bool) -> None:
    """Bring ``wheels`` up to date by a motion (3,) that a scan told where they had ``step`` (3,), righted.

    ``held``: whether the scan's place along the motion is told.
    """
    off = motion - step
    x, turn = step[0], step[2]
    size = abs(x) + 0.5 * abs(turn)
    apart = abs(off[0]) + abs(off[1]) + 0.5 * abs(off[2])
    if size < STANDING_M or apart > MOST_M + MOST_SHARE * size:
        return
    # Off from what the wheels themselves told.
    along = off[0] + wheels.off[0] * x
    turned = off[2] + wheels.off[1] * x + wheels.off[2] * turn
    a, b = 1.0 / MOTION_STD_M**2, 1.0 / TURN_STD_RAD**2
    information, told = wheels.information, wheels.told
    if held:
        information[0, 0] = FADING * information[0, 0] + a * x * x
        told[0] = FADING * told[0] + a * x * along
    information[1, 1] = FADING * information[1, 1] + b * x * x
    information[1, 2] = FADING * information[1, 2] + b * x * turn
    information[2, 2] = FADING * information[2, 2] + b * turn * turn
    told[1] = FADING * told[1] + b * x * turned
    told[2] = FADING * told[2] + b * turn * turned
    longer = told[0] / (information[0, 0] + 1.0 / SCALE_STD**2)
    p, q = information[1, 1] + 1.0 / A_METRE_STD_RAD**2, information[2, 2] + 1.0 / SCALE_STD**2
    r = information[1, 2]
    a_metre = (q * told[1] - r * told[2]) / (p * q - r * r)
    turned_more = (p * told[2] - r * told[1]) / (p * q - r * r)
    most = max(abs(longer) / SCALE_STD, abs(a_metre) / A_METRE_STD_RAD, abs(turned_more) / SCALE_STD)
    wheels.off[:] = 0.0
    if most <= CREDIBLE_STDS:
        wheels.off[0], wheels.off[1], wheels.off[2] = longer, a_metre, turned_more
