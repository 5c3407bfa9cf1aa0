"""Where people can walk: clearances on a lattice, and the shortest paths to the places that they go to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.grids.travel_cost import travel_costs
from pilotage.kernels.people.social_force import Ground
from pilotage.models.footprint import Footprint
from pilotage.sim.worlds.world import World

SPACING_M = 0.2
MOST_NODES = 150_000
"""Beyond so many the lattice is coarser."""
NARROW_M = 0.8
"""Nearer to a wall than this a metre costs more, up to twice as much."""
TRIES = 2000


@dataclass(frozen=True, slots=True, eq=False)
class WalkingGround:
    """A lattice over the map's bounds.

    Attributes
    ----------
    clearance_m
        (ny, nx) distance of the nodes from everything that stands still; row 0 has the lowest y.
    radius_m
        Of who walks: nodes with less room are none of theirs.
    """

    clearance_m: FloatArray
    origin_m: tuple[float, float]
    spacing_m: float
    radius_m: float

    @staticmethod
    def of(world: World, radius_m: float) -> WalkingGround:
        """Measure a world."""
        x0, y0, x1, y1 = world.chart.bounds_m
        spacing = max(SPACING_M, math.sqrt((x1 - x0) * (y1 - y0) / MOST_NODES))
        xs, ys = (
            low + np.arange(int((high - low) / spacing) + 1) * spacing for low, high in ((x0, x1), (y0, y1))
        )
        x, y = np.meshgrid(xs, ys)
        poses = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        body = Footprint.disc(radius_m)
        clear = np.minimum(world.clearance_m(body, poses) + radius_m, math.hypot(x1 - x0, y1 - y0))
        return WalkingGround(clear.reshape(x.shape), (x0, y0), spacing, radius_m)

    def node(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column of the nearest node."""
        ny, nx = self.clearance_m.shape
        row = round((y_m - self.origin_m[1]) / self.spacing_m)
        column = round((x_m - self.origin_m[0]) / self.spacing_m)
        return min(max(row, 0), ny - 1), min(max(column, 0), nx - 1)

    def has_room(self, x_m: float, y_m: float) -> bool:
        """Whether somebody can stand at the node there."""
        return bool(self.clearance_m[self.node(x_m, y_m)] > self.radius_m)

    def towards(self, goals_m: FloatArray, where: str) -> Ground:
        """Paths to goals (G, 2), as the walkers' kernel reads them.

        Raises
        ------
        InputError
            Where there is no room to stand at a goal, or no path between two.
        """
        price = 1.0 + np.clip(1.0 - self.clearance_m / NARROW_M, 0.0, 1.0)
        factor = np.where(self.clearance_m > self.radius_m, price, np.inf)
        costs, parents = [], []
        ends = [self.node(*goal) for goal in goals_m.tolist()]
        for index, (goal, end) in enumerate(zip(goals_m.tolist(), ends, strict=True)):
            if not self.has_room(*goal):
                raise InputError(
                    f"{where}.{index}: expected room for a person, found ({goal[0]:g}, {goal[1]:g}) in or at "
                    f"an obstacle; move it"
                )
            start = end[0] * factor.shape[1] + end[1]
            cost, parent = travel_costs(factor, start, self.spacing_m, self.spacing_m)
            if not math.isfinite(cost[ends[0][0] * factor.shape[1] + ends[0][1]]):
                raise InputError(f"{where}.{index}: expected a path to the first place, found none; move it")
            costs.append(cost)
            parents.append(parent)
        return Ground(self.clearance_m, np.array(costs), np.array(parents), *self.origin_m, self.spacing_m)

    def random_place(
        self, rng: np.random.Generator, reached: FloatArray, apart: FloatArray
    ) -> FloatArray | None:
        """(2,) a node that ``reached`` (ny * nx costs) knows a path from, clear of discs ``apart`` (N, 3).

        None after many tries.
        """
        ny, nx = self.clearance_m.shape
        for _ in range(TRIES):
            node = int(rng.integers(ny * nx))
            if not math.isfinite(reached[node]):
                continue
            place = np.array(self.origin_m) + self.spacing_m * np.array([node % nx, node // nx])
            if (np.hypot(*(apart[:, :2] - place).T) > apart[:, 2] + self.radius_m).all():
                return place
        return None

    def places_beside(
        self, x_m: float, y_m: float, count: int, rng: np.random.Generator, where: str
    ) -> list[FloatArray]:
        """Up to so many places by chance that a path leads to from a point."""
        reached, nobody = self.towards(np.array([[x_m, y_m]]), where).cost[0], np.zeros((0, 3))
        drawn = [self.random_place(rng, reached, nobody) for _ in range(count)]
        return [place for place in drawn if place is not None]
