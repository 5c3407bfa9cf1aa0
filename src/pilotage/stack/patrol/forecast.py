"""What idleness a plan leads to where robots are late and wait for each other: driven on paper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.patrol import traffic
from pilotage.kernels.patrol.rounds import turned_m
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.sections import sections, until_m

TIMES, LEGS = 4, 4096
"""A plan is driven so often; and how many legs' delays are drawn for each."""
AROUND = 3.0
"""Longest walks that it is driven for; the first one is not judged."""
STEPS = 64
"""Of driving, from one robot to the next on one walk of all, but for the least and the most in metres."""
LEAST_M, MOST_M = 0.05, 0.5
CLEAR_M = 0.5
"""So far before a passage and beyond it a robot is in the way of who waits there."""


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
        What waiting before a passage takes longer.
    late_ratio, slack, most_slack
        How late legs are, and when robots of a round wait for who is late.
    jam_late_ratio, jam_meeting_m
        Both of what robots are late by where they jam.
    beside_m
        At a vertex in a passage, or no farther beside one, nobody waits.
    talks
        Whether robots know where others are.
    """

    visit_m: float
    turn_m: float
    meeting_m: float
    late_ratio: float
    slack: float
    most_slack: float
    jam_late_ratio: float
    jam_meeting_m: float
    beside_m: float
    talks: bool


@lru_cache(maxsize=1024)
def forecast_m(plan: Plan, graph: PatrolGraph, passages: Passages, driving: Driving) -> tuple[float, float]:
    """Worst and mean idleness times speed, on average over a few times; the same for whoever asks.

    Robots begin evenly spread on their rounds. Of passages with room for one those who come the other way
    are kept out (``Section``), in the order in which they came; who comes the same way follows.

    Rounds may fit into each other such that nobody meets anybody while all are on time. Where they come
    through passages against each other at all, what meetings cost those who are later is added.
    """
    walks = _walks(plan, graph, passages, driving)
    usual_m = _driven_m(plan, walks, driving)
    if len(walks.mouths):
        late = replace(driving, late_ratio=driving.jam_late_ratio, meeting_m=driving.jam_meeting_m)
        alone = walks._replace(
            first_section=np.zeros_like(walks.first_section),
            mouths=np.zeros(0),
            through=np.zeros(0),
            until=np.zeros((0, 0)),
        )
        usual_m = usual_m + np.maximum(_driven_m(plan, walks, late) - _driven_m(plan, alone, late), 0.0)
    return float(usual_m[0]), float(usual_m[1])


def _driven_m(plan: Plan, walks: traffic.Walks, driving: Driving) -> FloatArray:
    """(2,) worst and mean, on average."""
    group = np.repeat(np.arange(len(plan.rounds)), plan.sizes)
    lengths = np.repeat([walk.length_m for walk in plan.rounds], plan.sizes)
    place = np.concatenate([np.arange(size) / size for size in plan.sizes])
    spaced_m = sum(walk.length_m for walk in plan.rounds) / len(group)
    total_m = AROUND * max(float(lengths.max()), 2.0 * spaced_m, 1.0)
    manner = traffic.Manner(
        float(np.clip(spaced_m / STEPS, LEAST_M, MOST_M)),
        total_m / AROUND,
        total_m,
        driving.visit_m,
        driving.meeting_m,
        driving.late_ratio,
        driving.slack,
        driving.most_slack,
        driving.talks,
    )
    # Every robot must come to the same plan: no stream of its own.
    rng = np.random.default_rng(0)
    driven = [
        traffic.drive_rounds(walks, group, place * lengths, rng.random(LEGS), manner) for _ in range(TIMES)
    ]
    return np.asarray(np.mean(driven, axis=0))


def _walks(plan: Plan, graph: PatrolGraph, passages: Passages, driving: Driving) -> traffic.Walks:
    places, rounds, narrow = np.ascontiguousarray(graph.vertices_xy_m), plan.rounds, sections(plan, passages)
    is_tight = np.zeros(len(graph), dtype=np.bool_)
    is_tight[list(passages.vertices_in(driving.beside_m))] = True
    every, kept_out_m = [section for walk in narrow for section in walk], until_m(narrow, passages)
    return traffic.Walks(
        np.cumsum([0, *(len(walk.stops) for walk in rounds)]),
        np.cumsum([0, *(len(walk) for walk in narrow)]),
        np.array([walk.length_m for walk in rounds]),
        np.concatenate([walk.stops for walk in rounds]),
        np.concatenate([np.diff(walk.at_m, append=walk.length_m) for walk in rounds]),
        np.concatenate([np.diff(turned_m(walk.stops, places, driving.turn_m)) for walk in rounds]),
        np.array([section.begin_m - CLEAR_M for section in every]),
        np.array([section.end_m - section.begin_m + 2.0 * CLEAR_M for section in every]),
        np.where(kept_out_m > 0.0, kept_out_m + 2.0 * CLEAR_M, 0.0),
        is_tight,
    )
