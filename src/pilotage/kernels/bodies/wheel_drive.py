"""A differential drive on the floor: motor lag, unequal wheels, slip, and boxes that stop it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.boxes import distance_to_boxes
from pilotage.kernels.jit import kernel

X, Y, THETA, SPEED_LEFT, SPEED_RIGHT, TURNED_LEFT, TURNED_RIGHT, WAY, CONTACTS, TOUCHING = range(10)
"""Entries of the state: pose, wheel speeds (rad/s), angles that the wheels turned (rad), way of the centre
(m), how many contacts there were, and whether it touches now."""
STATE_SIZE = 10

RADIUS_LEFT, RADIUS_RIGHT, SEPARATION, SLIP_LEFT, SLIP_RIGHT, SLIP_STD, LAG = range(7)
"""Entries of the parameters: true wheel radii and separation (m), shares lost to slip, random slip
(m per square-root metre), time constant of the motors (s)."""


@kernel
def drive(
    state: FloatArray,
    left: float,
    right: float,
    parameters: FloatArray,
    dt: float,
    noise: FloatArray,
    boxes: FloatArray,
    body_radius: float,
    rates: FloatArray,
) -> None:
    """Drive (N) samples of ``dt`` with the wheel speeds commanded, in place.

    Parameters
    ----------
    noise
        (N, 2) standard normals, one a wheel.
    rates
        (N,) out: true turn rate of each sample.

    Notes
    -----
    A wheel's speed follows its command with a first-order lag. A contact stops the centre while the
    wheels spin on and the body turns: the encoders do not feel it.
    """
    # Exact discretization of w' = (command - w) / lag over one sample.
    follow = 1.0 if parameters[LAG] == 0.0 else 1.0 - math.exp(-dt / parameters[LAG])
    for k in range(noise.shape[0]):
        state[SPEED_LEFT] += follow * (left - state[SPEED_LEFT])
        state[SPEED_RIGHT] += follow * (right - state[SPEED_RIGHT])
        angle_left, angle_right = state[SPEED_LEFT] * dt, state[SPEED_RIGHT] * dt
        state[TURNED_LEFT] += angle_left
        state[TURNED_RIGHT] += angle_right
        roll_left, roll_right = angle_left * parameters[RADIUS_LEFT], angle_right * parameters[RADIUS_RIGHT]
        slip_std = parameters[SLIP_STD]
        way_left = (
            roll_left * (1.0 - parameters[SLIP_LEFT]) + slip_std * math.sqrt(abs(roll_left)) * noise[k, 0]
        )
        way_right = (
            roll_right * (1.0 - parameters[SLIP_RIGHT]) + slip_std * math.sqrt(abs(roll_right)) * noise[k, 1]
        )
        way, turn = 0.5 * (way_left + way_right), (way_right - way_left) / parameters[SEPARATION]
        heading = state[THETA] + 0.5 * turn
        x, y = state[X] + way * math.cos(heading), state[Y] + way * math.sin(heading)
        before = distance_to_boxes(state[X], state[Y], boxes)
        after = distance_to_boxes(x, y, boxes)
        if after < body_radius and after <= before:
            if state[TOUCHING] == 0.0:
                state[CONTACTS] += 1.0
            state[TOUCHING] = 1.0
        else:
            state[X], state[Y] = x, y
            state[WAY] += abs(way)
            if after > body_radius + 1e-3:
                state[TOUCHING] = 0.0
        state[THETA] += turn
        rates[k] = turn / dt


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
