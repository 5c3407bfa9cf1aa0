"""What a robot is told of the patrol that it takes part in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.strategy import Strategy


@dataclass(frozen=True, slots=True, eq=False)
class PatrolSite:
    """What is patrolled.

    Attributes
    ----------
    graph
        Places to visit.
    visit_m
        A place counts as visited this near to it.
    near_m
        Whoever goes there comes so near, if it does not know its own place too badly: to places that are
        looked from nearer than to others.
    starts_m
        (N, V) length of the path from each robot's starting place to each vertex.
    passages
        Where the largest of the robots has a passage to itself.
    turn_m
        What turning back at a place costs the slowest to turn, as a distance.
    """

    graph: PatrolGraph
    visit_m: float
    near_m: float
    starts_m: FloatArray
    passages: Passages
    turn_m: float

    @property
    def starts(self) -> IntArray:
        """(N,) the vertex that each robot's starting place has the shortest path to."""
        return np.asarray(np.argmin(self.starts_m, axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Supply:
    """Where a team charges, and what a full battery is good for.

    Attributes
    ----------
    stations_xy_m
        (N, 2) one a robot.
    range_m, reserve_m
        What it drives on a full battery, and what it keeps of that beyond the path to its station.
    charge_s
        It stands there for so long.
    """

    stations_xy_m: FloatArray
    range_m: float
    reserve_m: float
    charge_s: float


@dataclass(frozen=True, slots=True, eq=False)
class PatrolPlaces:
    """Where a robot's paths lead to: (V, 2) places to visit, (N, 2) charging stations."""

    vertices_xy_m: FloatArray
    stations_xy_m: FloatArray
    visit_m: float

    @staticmethod
    def of(graph: PatrolGraph, supply: Supply | None, visit_m: float) -> PatrolPlaces:
        """Without stations where nobody charges."""
        stations = np.zeros((0, 2)) if supply is None else supply.stations_xy_m
        return PatrolPlaces(graph.vertices_xy_m, stations, visit_m)


@dataclass(frozen=True, slots=True, eq=False)
class PatrolTask:
    """Its share of a patrol.

    Attributes
    ----------
    graph
        Its edges are as long as the team drives them.
    visit_m, near_m, starts
        As ``PatrolSite``.
    robot
        Its number.
    strategy
        Who says where to go next.
    radii_m, brakings_m_s2
        (N,) of the discs around all robots, and how hard each brakes by its data sheet.
    supply
        None where it never has to charge.
    """

    graph: PatrolGraph
    visit_m: float
    near_m: float
    starts: IntArray
    robot: int
    strategy: Strategy
    radii_m: tuple[float, ...]
    brakings_m_s2: tuple[float, ...]
    supply: Supply | None = None

    @property
    def widest_mate_m(self) -> float:
        """Radius of the widest of the others; its own where it is alone."""
        others = self.radii_m[: self.robot] + self.radii_m[self.robot + 1 :]
        return max(others or self.radii_m)

    @property
    def places(self) -> PatrolPlaces:
        """Where its paths lead to."""
        return PatrolPlaces.of(self.graph, self.supply, self.visit_m)
