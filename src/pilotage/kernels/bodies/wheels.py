"""What two driven wheels do under their commands: motor lag, unequal radii, slip; and what encoders count."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import chord_ratio
from pilotage.kernels.jit import kernel

SPEED_LEFT, SPEED_RIGHT, TURNED_LEFT, TURNED_RIGHT = range(4)
"""Entries of the wheels' state: speeds (rad/s) and angles turned so far (rad)."""
STATE_SIZE = 4

RADIUS_LEFT, RADIUS_RIGHT, SEPARATION, SLIP_LEFT, SLIP_RIGHT, SLIP_STD, LAG = range(7)
"""Entries of the parameters: true wheel radii and separation (m), shares lost to slip, random slip
(m per square-root metre), time constant of the motors (s)."""


@kernel
def moves(
    state: FloatArray,
    left: float,
    right: float,
    parameters: FloatArray,
    dt: float,
    noise: FloatArray,
    out: FloatArray,
) -> None:
    """Turn the wheels for (N) samples of ``dt``, in place, and fill ``out`` (N, 3) with the body's moves.

    ``noise`` (N, 2) are standard normals, one a wheel. A wheel's speed follows its command with a
    first-order lag. The wheels' mean path is taken for the chord, as in the mid-angle model.
    """
    # Exact discretization of w' = (command - w) / lag over one sample.
    follow = 1.0 if parameters[LAG] == 0.0 else 1.0 - math.exp(-dt / parameters[LAG])
    slip_std = parameters[SLIP_STD]
    for k in range(noise.shape[0]):
        state[SPEED_LEFT] += follow * (left - state[SPEED_LEFT])
        state[SPEED_RIGHT] += follow * (right - state[SPEED_RIGHT])
        angle_left, angle_right = state[SPEED_LEFT] * dt, state[SPEED_RIGHT] * dt
        state[TURNED_LEFT] += angle_left
        state[TURNED_RIGHT] += angle_right
        roll_left, roll_right = angle_left * parameters[RADIUS_LEFT], angle_right * parameters[RADIUS_RIGHT]
        path_left = (
            roll_left * (1.0 - parameters[SLIP_LEFT]) + slip_std * math.sqrt(abs(roll_left)) * noise[k, 0]
        )
        path_right = (
            roll_right * (1.0 - parameters[SLIP_RIGHT]) + slip_std * math.sqrt(abs(roll_right)) * noise[k, 1]
        )
        turn = (path_right - path_left) / parameters[SEPARATION]
        # Beyond half a turn in one sample a chord tells nothing of a path, and may have no length at all.
        ratio = chord_ratio(turn) if abs(turn) < math.pi else 1.0
        out[k, 0] = 0.5 * (path_left + path_right) / ratio
        out[k, 1] = 0.0
        out[k, 2] = turn


@kernel
def read_counts(
    turned_left: float, turned_right: float, counted: IntArray, counts_per_turn: int, samples: int
) -> IntArray:
    """Whole encoder counts since the last reading, (2, ``samples``), left and right.

    ``counted`` (2,), what has been told so far, is brought up to date. Counts are spread over the samples as
    evenly as whole counts go.
    """
    out = np.zeros((2, samples), dtype=np.int64)
    for side in range(2):
        turned = turned_left if side == 0 else turned_right
        new = math.floor(turned * counts_per_turn / (2.0 * math.pi)) - counted[side]
        counted[side] += new
        for k in range(samples):
            out[side, k] = new * (k + 1) // samples - new * k // samples
    return out
