"""Hybrid A* (Dolgov, Thrun, Montemerlo and Diebel 2010): poses that a car can drive, over cells.

Each node is a true pose; of the poses in one cell of position and heading only the cheapest lives on. Steps
are arcs of least radius, to both sides, straight on, forwards and back; every so often a Reeds-Shepp curve
to the goal is tried.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.geometry.field import interpolate_at
from pilotage.kernels.jit import kernel
from pilotage.kernels.rrt.clearance import Space, near
from pilotage.kernels.rrt.dubins import advance
from pilotage.kernels.rrt.reeds_shepp import follow, shortest, word_length
from pilotage.kernels.rrt.samples import Bound, bound_at

FOUND, NO_PATH, EXHAUSTED = range(3)
CHECK_M = 0.04
"""Poses along a step are looked at this close together."""
STRIDE = 16
"""Of a long curve every so many of them are looked at first: most that do not fit end there."""


SLACK = 0.75
"""Interpolated distances of a 1-Lipschitz field are off by less than a node's diagonal: nodes apart."""


class Car(NamedTuple):
    """Outline (K, 2), its outer and inner radius, the clearance to keep and the least turning radius."""

    corners: FloatArray
    radius: float
    inner: float
    clearance: float
    turning: float


class Prices(NamedTuple):
    """What a metre backwards costs, a change of direction, and a metre of turning beside a straight one.

    What is left counts ``greed`` times (Pohl 1970): with more than 1 the search ends sooner, and less sure to
    be cheapest.
    """

    reverse: float
    switch: float
    turn: float
    greed: float


@kernel
def spare_at(x: float, y: float, theta: float, car: Car, ground: Space) -> float:
    """How far the outline's points may surely move from a pose and keep the clearance; negative: they do not.

    Exact geometry is asked only where the field cannot tell, and of it what is near (``clearance.near``).
    Nothing is known off the grid; and of a field alone no more than that the disc around the outline is free.
    """
    ny, nx = ground.distance.shape
    if not (0.0 <= x - ground.x0 <= (nx - 1) * ground.resolution) or not (
        0.0 <= y - ground.y0 <= (ny - 1) * ground.resolution
    ):
        return -1.0
    away = interpolate_at(x, y, ground.distance, ground.x0, ground.y0, ground.resolution)
    slack = SLACK * ground.resolution
    if away - slack >= car.radius + car.clearance:
        return float(away - slack - car.radius - car.clearance)
    if away + slack < car.inner + car.clearance:
        return float(away + slack - car.inner - car.clearance)
    if ground.margin == 0.0:
        return float(away - slack - car.radius - car.clearance)
    c, s = math.cos(theta), math.sin(theta)
    segments, circles = near(x, y, ground)
    clear = outline_clearance(x, y, c, s, car.corners, car.radius, segments, circles)
    return float(min(clear, ground.reach - car.radius) - car.clearance)


@kernel
def pose_fits(x: float, y: float, theta: float, car: Car, ground: Space) -> bool:
    """Whether the outline keeps its clearance."""
    return spare_at(x, y, theta, car, ground) >= 0.0


@kernel
def word_fits(
    x: float, y: float, theta: float, word: FloatArray, car: Car, ground: Space, look: float
) -> bool:
    """Whether a word can be driven from a pose that fits; poses are looked at ``look`` metres apart."""
    length = word_length(word, car.turning)
    count = max(1, math.ceil(length / look))
    # No point of the outline moves by more from one pose to the next.
    moves = max(length, 1e-9) / count * (1.0 + car.radius / car.turning)
    c, s = math.cos(theta), math.sin(theta)
    for stride in (STRIDE, 1):
        i = stride
        while i <= count:
            wx, wy, wth, _ = follow(word, length * i / count, car.turning)
            spare = spare_at(x + c * wx - s * wy, y + s * wx + c * wy, theta + wth, car, ground)
            if spare < 0.0:
                return False
            i += stride * (1 + int(min(spare / (stride * moves), count)))
    return True


@kernel
def arc_fits(
    x: float, y: float, theta: float, turn: int, length: float, spare: float, car: Car, ground: Space
) -> bool:
    """Whether a step, signed, can be driven from a pose with so much to spare (``spare_at``)."""
    count = max(1, math.ceil(abs(length) / CHECK_M))
    moves = abs(length) / count * (1.0 + car.radius / car.turning)
    i = 1 + int(min(max(spare, 0.0) / moves, count))
    while i <= count:
        px, py, angle = advance(x, y, theta, turn, car.turning, length * i / count)
        spare = spare_at(px, py, angle, car, ground)
        if spare < 0.0:
            return False
        i += 1 + int(min(spare / moves, count))
    return True


@kernel
def poses_that_fit(states: FloatArray, nearer: float, car: Car, ground: Space) -> int:
    """How many of the poses (N, 3), one after the other, keep the clearance.

    Of one that does not at the first of them the others come no nearer than that one, but for ``nearer``.
    """
    least = 0.0
    for i in range(states.shape[0]):
        spare = spare_at(states[i, 0], states[i, 1], states[i, 2], car, ground)
        if i == 0:
            least = min(spare, 0.0) - nearer
        elif spare < least:
            return i
    return int(states.shape[0])


@kernel
def path_fits(states: FloatArray, turns: bool, car: Car, ground: Space) -> bool:
    """Whether the outline fits along states (N, 3) and between them; ``turns``: on the spot at bends."""
    for i in range(states.shape[0]):
        before = states[max(i - 1, 0)]
        dx, dy = states[i, 0] - before[0], states[i, 1] - before[1]
        turned = (states[i, 2] - before[2] + math.pi) % (2.0 * math.pi) - math.pi
        sharp = turns and turned != 0.0
        length = math.hypot(dx, dy) + (0.0 if sharp else car.radius * abs(turned))
        count = max(1, math.ceil(length / CHECK_M))
        for k in range(1, count + 1):
            theta = before[2] if sharp else before[2] + turned * k / count
            if not pose_fits(before[0] + dx * k / count, before[1] + dy * k / count, theta, car, ground):
                return False
        if sharp:
            count = max(1, math.ceil(car.radius * abs(turned) / CHECK_M))
            for k in range(1, count + 1):
                if not pose_fits(states[i, 0], states[i, 1], before[2] + turned * k / count, car, ground):
                    return False
    return True


@kernel
def _slot(keys: IntArray, place: int) -> int:
    """Where a place is in a table of open addresses, -1 where none is; a power of two long, half empty."""
    mask = keys.shape[0] - 1
    at = ((place * -7046029254386353131) >> 20) & mask  # Fibonacci hashing (Knuth 1998, 6.4)
    while keys[at] != -1 and keys[at] != place:
        at = (at + 1) & mask
    return int(at)


@kernel
def search(
    start: FloatArray,
    goal: FloatArray,
    car: Car,
    ground: Space,
    prices: Prices,
    bound: Bound,
    step: float,
    cell: float,
    headings: int,
    most: int,
    nodes: FloatArray,
    parents: FloatArray,
) -> tuple[int, int, FloatArray, int]:
    """Search from start (3,) to goal (3,).

    Parameters
    ----------
    bound
        Of the path that is left to the disc inside the outline.
    step, cell, headings
        Length of a step, side of a cell, and how many headings are told apart.
    nodes, parents
        (M, 3) and (M, 3) are filled: poses; parent, turn and signed length of the step that led there.

    Returns
    -------
    status, last node, the word from there to the goal (5, 2), and how many nodes were expanded.
    """
    empty = np.zeros((5, 2))
    ny, nx = ground.distance.shape
    columns = math.ceil((nx - 1) * ground.resolution / cell) + 1
    rows = math.ceil((ny - 1) * ground.resolution / cell) + 1
    # No more cells are reached than there is room for nodes: of a large map only those are kept.
    places = columns * rows * headings
    table = 1
    while table < 2 * nodes.shape[0]:
        table *= 2
    hashed = places > table
    keys = np.full(table if hashed else 0, -1, np.int64)
    best = np.full(table if hashed else places, np.inf)
    closed = np.zeros(best.shape[0], np.bool_)
    cost = np.empty(nodes.shape[0])
    where = np.empty(nodes.shape[0], np.int64)
    nodes[0] = start
    parents[0, 0], parents[0, 1], parents[0, 2] = -1.0, 0.0, 0.0
    cost[0] = 0.0
    count = 1
    heap = [(0.0, 0)]
    expanded = 0
    shots = 0
    width = 2.0 * math.pi / headings
    where[0] = -1
    while len(heap) > 0:
        estimate, node = heapq.heappop(heap)
        at = where[node]
        if at >= 0:
            if closed[at]:
                continue
            closed[at] = True
        expanded += 1
        if expanded > most or count + 6 > nodes.shape[0]:
            return EXHAUSTED, -1, empty, expanded
        x, y, theta = nodes[node, 0], nodes[node, 1], nodes[node, 2]
        # A shot at the goal: always near it, seldom far away.
        left = estimate - cost[node]
        shots += 1
        if left < 12.0 * car.turning or shots >= int(left / car.turning):
            shots = 0
            word, _ = shortest(x, y, theta, goal[0], goal[1], goal[2], car.turning, prices.reverse)
            if word_fits(x, y, theta, word, car, ground, CHECK_M):
                return FOUND, node, word, expanded
        came = parents[node, 2]
        spare = spare_at(x, y, theta, car, ground)
        for choice in range(6):
            turn = choice % 3 - 1
            sign = 1.0 if choice < 3 else -1.0
            if not arc_fits(x, y, theta, turn, sign * step, spare, car, ground):
                continue
            ex, ey, eth = advance(x, y, theta, turn, car.turning, sign * step)
            col, row = int((ex - ground.x0) / cell), int((ey - ground.y0) / cell)
            if not (0 <= col < columns and 0 <= row < rows):
                continue
            turns = eth - 2.0 * math.pi * math.floor(eth / (2.0 * math.pi))
            bin_ = min(int(turns / width), headings - 1)
            place = (row * columns + col) * headings + bin_
            key = _slot(keys, place) if hashed else place
            if closed[key]:
                continue
            price = step * (prices.reverse if sign < 0.0 else 1.0)
            if turn != 0:
                price *= prices.turn
            if came != 0.0 and came * sign < 0.0:
                price += prices.switch
            new = cost[node] + price
            if new >= best[key]:
                continue
            best[key] = new
            if hashed:
                keys[key] = place
            around = bound_at(bound, ex, ey)
            _, free = shortest(ex, ey, eth, goal[0], goal[1], goal[2], car.turning, prices.reverse)
            nodes[count, 0], nodes[count, 1], nodes[count, 2] = ex, ey, eth
            parents[count, 0], parents[count, 1], parents[count, 2] = float(node), float(turn), sign * step
            cost[count], where[count] = new, key
            rest = max(around if math.isfinite(around) else 0.0, free)
            heapq.heappush(heap, (new + prices.greed * rest, count))
            count += 1
    return NO_PATH, -1, empty, expanded
