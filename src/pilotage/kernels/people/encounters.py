"""Robots among people over one step: how near they came, and who touched whom."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.drive import (
    ANGLE,
    BLOCKER,
    COLLISIONS,
    CONTACT_M,
    DISTANCE,
    GRAZE_M,
    LATERAL,
    THETA,
    TOUCHING,
    X,
    Y,
)
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.jit import kernel

CAUSED, SUFFERED, CLOSEST, NEAR, STEPS = range(5)
"""Columns of the tally: touches that the robot's own motion brought about, and others; least distance (m);
steps that ended within ``NEAR_M`` of somebody; steps."""
TALLY_SIZE = 5
NEAR_M = 0.5
"""Nearer than this people feel uneasy (the intimate distance of Hall 1966)."""
CLOSES_M_S = 0.02
"""A robot whose own motion closes a gap no faster than this does not drive into anybody."""
BEFORE = 0.02
"""Share of a step over which that is measured, up to the touch."""
APART, WALKED_INTO, HIT = 0, 1, 2
"""How a robot is with a person: apart; that one walked into it; it drove into that one."""


@kernel
def solid_people(
    states: FloatArray,
    corners: FloatArray,
    first: IntArray,
    radii: FloatArray,
    people: FloatArray,
    radius: FloatArray,
    between: IntArray,
) -> FloatArray:
    """Places (P, 2) of those whom robots cannot drive through; NaN for who has walked into one of them.

    Robots are where they were before the step, people where they are after it; see ``meet_people``.
    """
    out = people.copy()
    disc, no_sides = np.empty((1, 3)), np.empty((0, 4))
    for p in range(people.shape[0]):
        disc[0, 0], disc[0, 1], disc[0, 2] = people[p, 0], people[p, 1], radius[p]
        for r in range(states.shape[0]):
            if between[r, p] == WALKED_INTO:
                # Until they are apart, also in the step in which this one leaves.
                out[p, 0] = out[p, 1] = math.nan
                continue
            x, y, theta = states[r, X], states[r, Y], states[r, THETA]
            away = math.hypot(people[p, 0] - x, people[p, 1] - y) - radii[r] - radius[p]
            if not away < 0.0:
                continue
            shape = corners[first[r] : first[r + 1]]
            c, s = math.cos(theta), math.sin(theta)
            inside = outline_clearance(x, y, c, s, shape, radii[r], no_sides, disc) < 0.0
            if inside and between[r, p] == APART:
                out[p, 0] = out[p, 1] = math.nan
    return out


@kernel
def meet_people(
    before: FloatArray,
    states: FloatArray,
    corners: FloatArray,
    first: IntArray,
    radii: FloatArray,
    people_before: FloatArray,
    people: FloatArray,
    radius: FloatArray,
    dt: float,
    between: IntArray,
    tally: FloatArray,
) -> bool:
    """Count what a step brought, swept over the time between its ends.

    Robot and person move at once: the one along its arc at constant twist (what several moves add up to), the
    other straight. Conservative advancement on their distance, which changes no faster than both move.

    Parameters
    ----------
    before, states
        (R, 3) poses before the step; (R, STATE_SIZE) states after it (``bodies.drive``).
    corners, first, radii
        (K, 2) corners of all outlines, (R + 1,) where each begins, (R,) radii.
    people_before, people, radius
        (P, 2) places before and after, NaN for who is not there; (P,) radii.
    between
        (R, P) how each robot is with each person; in place.
    tally
        (R, TALLY_SIZE), in place.

    Returns
    -------
    Whether a robot drove into somebody.
    """
    hit = False
    disc, no_sides = np.empty((1, 3)), np.empty((0, 4))
    for r in range(states.shape[0]):
        state, shape = states[r], corners[first[r] : first[r + 1]]
        distance, lateral, angle = state[DISTANCE], state[LATERAL], state[ANGLE]
        reach = math.hypot(distance, lateral) + radii[r] * abs(angle)
        nearest = math.inf
        for p in range(people.shape[0]):
            x, y = people[p, 0], people[p, 1]
            if math.isnan(x):
                between[r, p] = APART
                continue
            x0, y0 = people_before[p, 0], people_before[p, 1]
            appears = math.isnan(x0)
            if appears:
                x0, y0 = x, y
            walked = math.hypot(x - x0, y - y0)
            far = math.hypot(x - before[r, 0], y - before[r, 1]) - radii[r] - radius[p]
            if far > reach + walked and far - reach > max(NEAR_M, tally[r, CLOSEST]):
                between[r, p] = APART
                continue
            part, touched, closing = 0.0, False, 0.0
            while True:
                px, py, theta = turned_part(
                    before[r, 0], before[r, 1], before[r, 2], distance, lateral, angle, part
                )
                disc[0, 0], disc[0, 1] = x0 + part * (x - x0), y0 + part * (y - y0)
                disc[0, 2] = radius[p]
                clear = outline_clearance(
                    px, py, math.cos(theta), math.sin(theta), shape, radii[r], no_sides, disc
                )
                # Who walked into it goes through it, and is no nearer than at it.
                tally[r, CLOSEST] = min(tally[r, CLOSEST], max(clear, 0.0))
                if clear < CONTACT_M:
                    touched = True
                    # The person held where it is: what the robot alone did to the gap just before.
                    px, py, theta = turned_part(
                        before[r, 0], before[r, 1], before[r, 2], distance, lateral, angle, part - BEFORE
                    )
                    c, s = math.cos(theta), math.sin(theta)
                    closing = outline_clearance(px, py, c, s, shape, radii[r], no_sides, disc) - clear
                if part >= 1.0 or touched or reach + walked == 0.0:
                    break
                part = min(1.0, part + max(clear, GRAZE_M) / (reach + walked))
            disc[0, 0], disc[0, 1] = x, y
            c, s = math.cos(state[THETA]), math.sin(state[THETA])
            clear = outline_clearance(state[X], state[Y], c, s, shape, radii[r], no_sides, disc)
            nearest = min(nearest, clear)
            # Of one whose wheels spin on the centre stays short of whom it drove into.
            touched = touched or clear < state[BLOCKER] - 1.0 + CONTACT_M
            if not touched:
                between[r, p] = APART
                continue
            anew = between[r, p] == APART and not appears
            # Who walked into it is not solid to it, and so not who stopped it.
            stopped = state[BLOCKER] > 0.0 and between[r, p] != WALKED_INTO
            drove = stopped or (anew and closing > CLOSES_M_S * BEFORE * dt)
            if drove and between[r, p] != HIT:
                between[r, p] = HIT
                hit = True
                tally[r, CAUSED] += 1.0
                if state[TOUCHING] == 0.0:
                    state[COLLISIONS] += 1.0
                    state[TOUCHING] = 1.0
            elif between[r, p] == APART:
                between[r, p] = WALKED_INTO
                tally[r, SUFFERED] += 1.0
        tally[r, STEPS] += 1.0
        tally[r, NEAR] += 1.0 if nearest < NEAR_M else 0.0
    return hit
