"""What idleness a plan leads to where robots are late and wait for each other: driven on paper."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pilotage.kernels.patrol import traffic
from pilotage.kernels.patrol.rounds import turned_m
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.sections import sections, until_m

TIMES, DRAWS = 8, 4096
"""A plan is driven so often; and how many delays are drawn for each."""
ROUNDS, GAPS = 2.0, 24.0
"""It is judged for so many of its longest walks, or mean distances between robots, once it has been driven
round that walk: alike whatever the plan, for what is rare counts in the worst."""
PASSED_RATIO = 0.7
"""Of the breadth of a place's surroundings, on average of what robots cross: they pass by it."""
STEPS = 64
"""Of driving, from one robot to the next on one walk of all, but for the least and the most in metres."""
LEAST_M, MOST_M = 0.05, 0.5
CLEAR_M = 0.5
"""So far before a passage and beyond it a robot is in the way of who waits there."""
NOT_TIGHT = np.zeros(0)


@dataclass(frozen=True, slots=True)
class Driving:
    """How a team drives; distances, and shares as ``kernels.patrol.traffic.Manner`` has them.

    Attributes
    ----------
    visit_m
        Who is so near to a vertex visits it.
    turn_m
        What turning back at a vertex costs.
    meeting_m
        What two who meet lose on average where they have just room abreast.
    leg_spread_m, slack, most_slack
        How much legs differ, and when robots of a round wait for who is late.
    beside_m
        At a vertex in a passage, or no farther beside one, nobody waits.
    talks
        Whether robots know where others are.
    """

    visit_m: float
    turn_m: float
    meeting_m: float
    leg_spread_m: float
    slack: float
    most_slack: float
    beside_m: float
    talks: bool


@lru_cache(maxsize=1024)
def forecast_m(plan: Plan, graph: PatrolGraph, passages: Passages, driving: Driving) -> tuple[float, float]:
    """Worst and mean idleness times full speed, on average over a few times; the same for whoever asks.

    Robots begin evenly spread on their rounds; those who hear nobody are anywhere on theirs after a while. Of
    passages with room for one those who come the other way are kept out (``Section``), in the order in which
    they came; who comes the same way follows.
    """
    walks = _walks(plan, graph, passages, driving)
    group = np.repeat(np.arange(len(plan.rounds)), plan.sizes)
    lengths = np.repeat([walk.length_m for walk in plan.rounds], plan.sizes)
    place = np.concatenate([np.arange(size) / size for size in plan.sizes])
    spaced_m = sum(walk.length_m for walk in plan.rounds) / len(group)
    longest_m = max(float((lengths / walks.pace[group]).max()), 2.0 * spaced_m, 1.0)
    manner = traffic.Manner(
        float(np.clip(spaced_m / STEPS, LEAST_M, MOST_M)),
        longest_m,
        longest_m + max(ROUNDS * longest_m, GAPS * spaced_m),
        PASSED_RATIO * driving.visit_m,
        driving.meeting_m,
        driving.leg_spread_m,
        driving.slack,
        driving.most_slack,
        driving.talks,
    )
    # Every robot must come to the same plan: no stream of its own.
    rng = np.random.default_rng(0)
    drifts = not driving.talks and driving.leg_spread_m > 0.0
    is_shared = np.repeat(plan.sizes, plan.sizes) > 1
    anywhere = np.random.default_rng(1).random((TIMES, len(place)))
    places = np.where(drifts & is_shared, anywhere, place)
    driven = [
        traffic.drive_rounds(walks, group, begun * lengths, rng.random(DRAWS), manner) for begun in places
    ]
    worst_m, mean_m = np.mean(driven, axis=0).tolist()
    return worst_m, mean_m


def _walks(plan: Plan, graph: PatrolGraph, passages: Passages, driving: Driving) -> traffic.Walks:
    places, rounds, narrow = np.ascontiguousarray(graph.vertices_xy_m), plan.rounds, sections(plan, passages)
    is_tight = np.zeros(len(graph), dtype=np.bool_)
    is_tight[list(passages.vertices_in(driving.beside_m))] = True
    tight = [
        passages.tight.get((int(here), int(there)), NOT_TIGHT)
        for walk in rounds
        for here, there in zip(walk.stops, np.roll(walk.stops, -1), strict=True)
    ]
    every, kept_out_m = [section for walk in narrow for section in walk], until_m(narrow, passages)
    return traffic.Walks(
        np.cumsum([0, *(len(walk.stops) for walk in rounds)]),
        np.cumsum([0, *(len(walk) for walk in narrow)]),
        np.array([walk.length_m for walk in rounds]),
        np.array(plan.paces),
        np.concatenate([walk.stops for walk in rounds]),
        np.concatenate([np.diff(walk.at_m, append=walk.length_m) for walk in rounds]),
        np.concatenate([np.diff(turned_m(walk.stops, places, driving.turn_m)) for walk in rounds]),
        np.array([section.begin_m - CLEAR_M for section in every]),
        np.array([section.end_m - section.begin_m + 2.0 * CLEAR_M for section in every]),
        np.where(kept_out_m > 0.0, kept_out_m + 2.0 * CLEAR_M, 0.0),
        places,
        graph.shortest_m,
        np.cumsum([0, *(len(leg) for leg in tight)]),
        np.concatenate(tight),
        is_tight,
    )
