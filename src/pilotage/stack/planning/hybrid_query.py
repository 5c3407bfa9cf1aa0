"""One search of Hybrid A*, as often and as finely as is asked for, and from either end."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.rrt import hybrid, reeds_shepp
from pilotage.kernels.rrt.clearance import Space
from pilotage.kernels.rrt.samples import Bound
from pilotage.stack.planning.outline import word_states

STEP_CELLS = 1.5
"""A step leaves its cell."""


@dataclass(frozen=True, slots=True)
class Grain:
    """Length of a step, side of a cell, and how many headings are told apart."""

    step_m: float
    cell_m: float
    headings: int

    def finer(self, share: float) -> Grain:
        """Steps of a share of the length, cells that these leave, and headings by as much finer."""
        step_m = share * self.step_m
        cell_m = min(self.cell_m, step_m / (STEP_CELLS + 1.0))
        return Grain(step_m, cell_m, math.ceil(self.headings / share))

    def coarser(self, times: float) -> Grain:
        """Steps and cells so many times as long; as many headings."""
        return Grain(times * self.step_m, times * self.cell_m, self.headings)


@dataclass(frozen=True, slots=True)
class Found:
    """How a search ended, after how many expansions; the last node and the word from there where it found."""

    ended: int
    last: int
    word: FloatArray
    expanded: int


@dataclass(frozen=True, slots=True, eq=False)
class HybridQuery:
    """From a pose (3,) to a pose (3,), with a lower bound of what is left, and room for nodes.

    ``reversed_time``: what is searched for is the path from its end, by a car that is driven the other way.
    """

    start: FloatArray
    goal: FloatArray
    car: hybrid.Car
    ground: Space
    bound: Bound
    nodes: FloatArray
    parents: FloatArray
    reversed_time: bool = False

    def search(self, prices: hybrid.Prices, grain: Grain, most: int) -> Found:
        """Expand so many nodes at most."""
        return Found(
            *hybrid.search(
                self.start,
                self.goal,
                self.car,
                self.ground,
                prices,
                self.bound,
                max(grain.step_m, STEP_CELLS * grain.cell_m),
                grain.cell_m,
                grain.headings,
                most,
                self.nodes,
                self.parents,
            )
        )

    def from_its_end(self, bound: Bound) -> HybridQuery:
        """The same path sought from the goal: what is driven forwards is forwards there too, tail first.

        A car that goes back in time moves tail first where it drives forwards: its outline is turned by half
        a turn on its axle, and so are both poses.
        """
        half_turn = np.array([0.0, 0.0, math.pi])
        car = self.car._replace(corners=read_only(-self.car.corners))
        start, goal = self.goal + half_turn, self.start + half_turn
        return replace(self, start=start, goal=goal, car=car, bound=bound, reversed_time=True)

    def states(self, found: Found) -> tuple[FloatArray, float]:
        """(N, 3) states along the steps and the last curve, and the path's length."""
        steps, turning_m = [], self.car.turning
        node = found.last
        while self.parents[node, 0] >= 0.0:
            steps.append((self.parents[node, 1], self.parents[node, 2] / turning_m))
            node = int(self.parents[node, 0])
        words = [np.array([step]) for step in reversed(steps)] + [found.word]
        states, total = [self.start[None, :]], 0.0
        for part in words:
            states.append(word_states(states[-1][-1], part, turning_m))
            for piece in part:
                total += reeds_shepp.word_length(piece[None, :], turning_m)
        along = np.concatenate(states)
        if self.reversed_time:
            along = along[::-1].copy()
            along[:, 2] = wrap_array_to_pi(along[:, 2] - math.pi)
        return (along if len(along) > 1 else np.repeat(along, 2, axis=0)), total
