"""What turning back at places adds to the rounds of a plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pilotage.kernels.patrol.rounds import turned_m
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan


def with_turns(plan: Plan, graph: PatrolGraph, turn_m: float) -> Plan:
    """The plan with rounds as long as they are where each time of turning back costs a distance."""
    if turn_m <= 0.0:
        return plan
    places = np.ascontiguousarray(graph.vertices_xy_m)
    rounds = []
    for walk in plan.rounds:
        before_m = turned_m(walk.stops, places, turn_m)
        rounds.append(
            replace(walk, at_m=walk.at_m + before_m[:-1], length_m=walk.length_m + float(before_m[-1]))
        )
    return replace(plan, rounds=tuple(rounds))
