"""A body that drives, and stops where its outline first touches something: between two steps as well.

What is solid is handed over as in ``geometry.solids``.
"""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.clearances import all_clearance, fixed_clearance, others_clearance
from pilotage.kernels.geometry.motion import chord_ratio, turned_part
from pilotage.kernels.geometry.solids import Fixed, Others, Outline, is_anybody
from pilotage.kernels.jit import kernel

(
    X,
    Y,
    THETA,
    CLEARANCE,
    FIXED_CLEARANCE,
    TOUCHING,
    COLLISIONS,
    DRIVEN,
    DISTANCE,
    LATERAL,
    ANGLE,
    BLOCKED,
    BLOCKER,
) = range(13)
"""Entries of a body's state: pose; clearance from everything and from what does not move (m); 1 while it
touches, 2 where another body ran into it; how often it ran into something; path of the centre (m); of the
last step forward and lateral distance, angle, 1 where something stopped it, 1 where that was another body
and by how much (m) the centre stays short of it, its wheels spinning on."""
STATE_SIZE = 13

CONTACT_TOLERANCE_M = 1e-9
"""An overlap below this is rounding."""
GRAZE_M = 1e-3
"""Near a wall a path is looked at this often; what could slip through between is half of it at most."""
CONTACT_M = 1e-6
"""Bodies nearer than this touch."""
BISECTIONS = 40
MOST_LOOKS = 100_000
"""At one move: exact along a hundred metres of a wall, coarser for what no robot does in a step."""


@kernel
def first_contact(
    x: float,
    y: float,
    theta: float,
    distance: float,
    lateral: float,
    angle: float,
    clearance: float,
    outline: Outline,
    fixed: Fixed,
    others: Others,
    own: IntArray,
) -> float:
    """Part of a move that the outline can drive: 1 without a contact.

    Clearance is 1-Lipschitz in how far the outline's points move, so where it is large nothing has to be
    looked at (conservative advancement). Leaving a contact is allowed: only a clearance that is negative
    and shrinking stops the body.

    Parameters
    ----------
    clearance
        At the start of the move.
    """
    corners, radius, inner = outline
    reach = math.hypot(distance, lateral)
    if corners.shape[0] > 0:
        reach += radius * abs(angle)
    if clearance > reach or reach == 0.0:
        return 1.0
    pieces = max(1, math.ceil(min(reach / (0.25 * inner), MOST_LOOKS)))
    length = reach / pieces
    last, last_clearance = 0.0, clearance
    i = 0
    while i < pieces:
        # As far as it is clear there is nothing to look at: beyond all walls a few looks do.
        i = min(i + max(1, math.floor(min(last_clearance, reach) / length)), pieces)
        part = i / pieces
        px, py, ptheta = turned_part(x, y, theta, distance, lateral, angle, part)
        here = all_clearance(px, py, ptheta, outline, fixed, others, own)
        low, high = -1.0, part
        if here < -CONTACT_TOLERANCE_M and here < last_clearance:
            low = last
        elif last_clearance + here < reach * (part - last):
            # Both ends are clear, but there may be a contact between them.
            at, at_clearance = last, last_clearance
            while at < part:
                ahead = min(part, at + max(max(at_clearance, GRAZE_M) / reach, 1.0 / MOST_LOOKS))
                px, py, ptheta = turned_part(x, y, theta, distance, lateral, angle, ahead)
                there = all_clearance(px, py, ptheta, outline, fixed, others, own)
                if there < -CONTACT_TOLERANCE_M and there < at_clearance:
                    low, high = at, ahead
                    break
                at, at_clearance = ahead, there
        if low >= 0.0:
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                px, py, ptheta = turned_part(x, y, theta, distance, lateral, angle, middle)
                there = all_clearance(px, py, ptheta, outline, fixed, others, own)
                if there < 0.0:
                    high = middle
                else:
                    low = middle
            return low
        last, last_clearance = part, here
    return 1.0


@kernel
def place_outline(
    state: FloatArray,
    outline: Outline,
    others: Others,
    own: IntArray,
) -> None:
    """Write where a body's outline is into its own rows, for the others to meet."""
    x, y = state[X], state[Y]
    corners, (sides, discs) = outline[0], others
    if own[2] >= 0:
        discs[own[2], 0], discs[own[2], 1] = x, y
        return
    c, s = math.cos(state[THETA]), math.sin(state[THETA])
    count = own[1] - own[0]
    for i in range(count):
        px, py = x + c * corners[i, 0] - s * corners[i, 1], y + s * corners[i, 0] + c * corners[i, 1]
        before = own[0] + (i - 1 if i > 0 else count - 1)
        sides[own[0] + i, 0], sides[own[0] + i, 1] = px, py
        sides[before, 2], sides[before, 3] = px, py


@kernel
def meet_others(
    states: FloatArray,
    corners: FloatArray,
    first: IntArray,
    radii: FloatArray,
    others: Others,
    own: IntArray,
    first_person: int,
) -> bool:
    """After everybody moved: bring clearances up to date, and count being touched by another robot.

    Parameters
    ----------
    states
        (R, STATE_SIZE) of all bodies.
    corners, first
        (K, 2) of all polygons, and (R + 1,) where each begins.
    first_person
        Row of the discs from which on they are people, who are counted elsewhere.

    Returns
    -------
    Whether a body was run into or still counts as such.
    """
    marked = False
    for r in range(states.shape[0]):
        state = states[r]
        outline = (corners[first[r] : first[r + 1]], radii[r], 0.0)
        gap = nearest = others_clearance(state[X], state[Y], state[THETA], outline, others, own[r])
        if first_person < others[1].shape[0] and gap < CONTACT_M:
            robots = (others[0], others[1][:first_person])
            gap = others_clearance(state[X], state[Y], state[THETA], outline, robots, own[r])
            # Who walked into it goes through it, and is no nearer than at it.
            nearest = min(gap, max(nearest, 0.0))
        state[CLEARANCE] = min(state[FIXED_CLEARANCE], nearest)
        if gap < CONTACT_M and state[TOUCHING] == 0.0:
            state[COLLISIONS] += 1.0
            state[TOUCHING] = 2.0
        marked = marked or state[BLOCKER] > 0.0 or state[TOUCHING] == 2.0
    return marked


@kernel
def drive(
    state: FloatArray,
    moves: FloatArray,
    rates: FloatArray,
    period: float,
    spins_on: bool,
    release: float,
    outline: Outline,
    fixed: Fixed,
    others: Others,
    own: IntArray,
) -> bool:
    """Drive one step in place: (K, 3) moves at constant twist, each forward, to the left, turned.

    Parameters
    ----------
    rates
        (K,) out: the true turn rate in each move.
    period
        How long the step is, in seconds.
    spins_on
        Whether the wheels spin on at a contact: the centre stays, the body turns as far as it can, and the
        next move is tried. Otherwise a contact ends the step.
    release
        How clear it has to be again before a new contact counts.

    Returns
    -------
    Whether something stopped it.
    """
    state[DISTANCE] = state[LATERAL] = state[ANGLE] = state[BLOCKED] = state[BLOCKER] = 0.0
    count = moves.shape[0]
    rates[:] = 0.0
    x, y, theta = state[X], state[Y], state[THETA]
    gap = others_clearance(x, y, theta, outline, others, own)
    clearance = min(state[FIXED_CLEARANCE], gap)
    for k in range(count):
        distance, lateral, angle = moves[k, 0], moves[k, 1], moves[k, 2]
        part = first_contact(x, y, theta, distance, lateral, angle, clearance, outline, fixed, others, own)
        stopped = part < 1.0
        if stopped:
            ahead, ahead_y, ahead_theta = turned_part(x, y, theta, distance, lateral, angle, part)
            short = part * math.hypot(distance, lateral) if spins_on else 0.0
            if spins_on:
                distance, lateral, part = 0.0, 0.0, 1.0
                if outline[0].shape[0] > 0:
                    part = first_contact(x, y, theta, 0.0, 0.0, angle, clearance, outline, fixed, others, own)
            if others_clearance(ahead, ahead_y, ahead_theta, outline, others, own) < CONTACT_M:
                state[BLOCKER] = 1.0 + short
        x, y, theta = turned_part(x, y, theta, distance, lateral, angle, part)
        state[FIXED_CLEARANCE] = fixed_clearance(x, y, theta, outline, fixed)
        gap = others_clearance(x, y, theta, outline, others, own)
        clearance = min(state[FIXED_CLEARANCE], gap)
        distance, lateral, angle = distance * part, lateral * part, angle * part
        state[DISTANCE] += distance
        state[LATERAL] += lateral
        state[ANGLE] += angle
        state[DRIVEN] += math.hypot(distance, lateral)
        rates[k] = angle * count / period
        if stopped:
            state[COLLISIONS] += 1.0 if state[TOUCHING] == 0.0 else 0.0
            state[TOUCHING] = state[BLOCKED] = 1.0
            if not spins_on:
                break
        elif state[TOUCHING] == 1.0 and clearance >= release:
            state[TOUCHING] = 0.0
    if count > 1 and abs(state[ANGLE]) < math.pi:
        # Moves that turn differently add up to no arc: what is beside it is told as driven to the left.
        dx, dy, ratio = x - state[X], y - state[Y], chord_ratio(state[ANGLE])
        middle = state[THETA] + 0.5 * state[ANGLE]
        c, s = math.cos(middle), math.sin(middle)
        state[DISTANCE], state[LATERAL] = (c * dx + s * dy) / ratio, (c * dy - s * dx) / ratio
    state[X], state[Y], state[THETA], state[CLEARANCE] = x, y, theta, clearance
    if is_anybody(others):
        place_outline(state, outline, others, own)
    return bool(state[BLOCKED] > 0.0)
