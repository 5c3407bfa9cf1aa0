"""A path for an outline made cheaper by curves between places along it, backwards only if it is so itself."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.rrt import hybrid
from pilotage.kernels.rrt.outline_chain import cheapest_chain
from pilotage.kernels.rrt.outline_star import Driver
from pilotage.kernels.rrt.reeds_shepp import word_length
from pilotage.kernels.rrt.steering import Steering, curve_between
from pilotage.stack.planning.outline import FINE_M, car_of, distinct, ground_of, skin_m, word_states
from pilotage.stack.planning.planner import Path, PlanRequest

REVERSE_COST, SWITCH_COST_M = 1.5, 0.5
"""Of a metre backwards and a change of direction, as the planners for outlines have them."""


class _Line(NamedTuple):
    """A path's states (N, 3), its length, and per step its share of that and its direction, 1 or -1."""

    states: FloatArray
    length_m: float
    steps_m: FloatArray
    gears: IntArray

    @staticmethod
    def of(states: FloatArray, length_m: float) -> _Line:
        """Chords, made as long together as the path."""
        delta = np.diff(states[:, :2], axis=0)
        middle = states[:-1, 2] + 0.5 * wrap_array_to_pi(np.diff(states[:, 2]))
        ahead = delta[:, 0] * np.cos(middle) + delta[:, 1] * np.sin(middle)
        chords = np.hypot(delta[:, 0], delta[:, 1])
        return _Line(
            states,
            length_m,
            chords * (length_m / max(float(chords.sum()), 1e-9)),
            np.where(ahead >= 0.0, 1, -1).astype(np.int64),
        )

    def full_price_m(self) -> float:
        """Of all steps."""
        return self.price_m(0, len(self.gears), SWITCH_COST_M)

    def price_m(self, first: int, last: int, switch_cost_m: float) -> float:
        """Of the steps from state ``first`` to state ``last``."""
        steps, gears = self.steps_m[first:last], self.gears[first:last]
        dear = float(np.where(gears > 0, steps, REVERSE_COST * steps).sum())
        return dear + switch_cost_m * float(np.count_nonzero(np.diff(gears)))


def shortened(
    path: Path, request: PlanRequest, clearance_m: float, spacing_m: float, most: int, rounds: int
) -> tuple[FloatArray, float]:
    """States and length of a path that is no dearer and no longer, as clear and as wide in its turns.

    Parameters
    ----------
    spacing_m, most
        Between the places along it between which curves are tried, and how many of them there are at most.
    rounds
        So often, from new places each time.
    """
    line = _Line.of(path.states, path.length_m)
    reverses = bool((line.gears < 0).any())
    steering = Steering(path.turning_radius_m, reverses, REVERSE_COST, SWITCH_COST_M)
    car = car_of(request.footprint, clearance_m, path.turning_radius_m)
    ground = ground_of(request.field, car)
    spare_m = max(skin_m(path.states[0], path.states[-1], car, ground), 0.0)
    driver = Driver(steering, car._replace(clearance=clearance_m + spare_m), ground)
    for _ in range(rounds):
        shorter = _once(line, driver, spacing_m, most)
        if shorter is None:
            break
        gained_m, line = line.length_m - shorter.length_m, shorter
        if gained_m < 1e-4 * line.length_m:
            break
    return line.states, line.length_m


def _once(line: _Line, driver: Driver, spacing_m: float, most: int) -> _Line | None:
    """One pass; None where nothing is gained."""
    s = np.concatenate([[0.0], np.cumsum(line.steps_m)])
    count = max(2, min(most, math.ceil(s[-1] / spacing_m) + 1))
    picked = np.unique([0, *np.searchsorted(s, np.linspace(0.0, s[-1], count)[1:-1]), len(s) - 1])
    if len(picked) < 2 or not s[-1] > 0.0:
        return None
    own = np.array([line.price_m(a, b, SWITCH_COST_M) for a, b in pairwise(picked)])
    ends = np.column_stack([line.gears[picked[:-1]], line.gears[picked[1:] - 1]])
    places = np.ascontiguousarray(line.states[picked])
    chain, kept = cheapest_chain(places, own, ends, driver)
    if kept.all():
        return None
    states, length_m = [line.states[:1]], 0.0
    for k in range(len(kept)):
        first, last = int(picked[chain[k]]), int(picked[chain[k + 1]])
        (x, y, theta), (gx, gy, gth) = line.states[first], line.states[last]
        word, _ = curve_between(x, y, theta, gx, gy, gth, driver.steering)
        # One that does not fit when looked at closely leaves the path's own piece, and the other curves.
        if kept[k] or not hybrid.word_fits(x, y, theta, word, driver.car, driver.ground, FINE_M):
            states.append(line.states[first + 1 : last + 1])
            length_m += float(s[last] - s[first])
            continue
        states.append(word_states(line.states[first], word, driver.steering.radius))
        length_m += word_length(word, driver.steering.radius)
    found = _Line.of(distinct(np.concatenate(states), line.states[-1]), length_m)
    is_dearer = found.full_price_m() > line.full_price_m() + 1e-9
    return None if is_dearer or length_m > line.length_m else found
