"""What a robot is told of the patrol that it takes part in."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import IntArray
from pilotage.stack.patrol.graph import PatrolGraph
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
    """

    graph: PatrolGraph
    visit_m: float


@dataclass(frozen=True, slots=True, eq=False)
class PatrolTask:
    """Its share of a patrol.

    Attributes
    ----------
    graph, visit_m
        As ``PatrolSite``.
    robot
        Its number.
    starts
        (N,) the vertex nearest to each robot's starting place.
    strategy
        Who says where to go next.
    """

    graph: PatrolGraph
    visit_m: float
    robot: int
    starts: IntArray
    strategy: Strategy
