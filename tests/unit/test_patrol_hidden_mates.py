"""Robots on patrol brake for mates that walls hide, by what these tell."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.word import Talk, TeamWord
from support.two_rooms import DOOR_Y_M, two_rooms

RADIUS_M, TOLD_M, GAP_M, REACTS_S, WEAK_M_S2 = 0.3, 0.2, 0.1, 0.25, 0.3
BESIDE_DOOR = Pose2(4.5, 3.6, -math.pi / 2)
"""Along the wall between two rooms, towards the door in it, which is 1 m wide."""
NEWS = PatrolMemory(2, 0, 3, 0, 1.0).message(0.0)


def driving(braking_m_s2: float, v_m_s: float = 1.0, pose: Pose2 = BESIDE_DOOR) -> Any:
    """One of three robots, with a new scan that shows nothing near."""
    values = two_rooms(DOOR_Y_M)
    values["robot"]["motion"]["max_acceleration_m_s2"] = braking_m_s2
    stack: Any = build(mission_of(values, seed=0)).team[1].stack
    context = stack._context
    context.pose, context.twist, context.fresh, context.t_s = pose, Twist(v_m_s, 0.0), True, 1.0
    return context


def tell(context: Any, x_m: float, y_m: float, sent_s: float = 1.0) -> None:
    """A mate says where it is."""
    talk = Talk(1.0, 60.0, 0.0, 1.0)
    context.hear(sent_s, TeamWord(x_m, y_m, False, None, None, NEWS, RADIUS_M, talk=talk))


def fronts(context: Any, stop_m: float) -> FloatArray:
    found: FloatArray = context.motion._hidden_mates.fronts(stop_m)
    return found


def told_speed(context: Any) -> float:
    """Down the field to the far end of the other room."""
    context.motion.watch(lost=False)
    places = context.roadmap.places_xy_m
    command = context.lead(int(np.argmax(places[:, 0])))
    return float(command.v_m_s)


@pytest.mark.parametrize("sent_s", [1.0, 0.4])
def test_mates_behind_a_wall_are_as_far_as_the_way_through_the_door_is(sent_s: float) -> None:
    context = driving(WEAK_M_S2)
    tell(context, 5.6, 2.6, sent_s)
    found = fronts(context, 2.0)
    edge = np.array([5.0, DOOR_Y_M + 0.5])
    shortest_m = math.dist((4.5, 3.6), edge) + math.dist(edge, (5.6, 2.6))
    # Round the edge half of the body's radius is kept; the first node is up to 0.2 m from the mate.
    away_m = float(np.hypot(*found[0])) + RADIUS_M + TOLD_M + 1.0 * (1.0 - sent_s)
    assert len(found) == 1
    assert shortest_m - 0.3 < away_m < shortest_m + 0.25
    # Ahead is down along the wall; the edge lies to the left of that.
    assert 0.0 < math.atan2(found[0, 1], found[0, 0]) < 0.4


def test_who_is_seen_or_too_far_to_matter_or_shut_off_is_none() -> None:
    seen = driving(WEAK_M_S2)
    tell(seen, 4.5, 1.8)
    assert len(fronts(seen, 2.0)) == 1
    seen.strange = np.array([[1.55, 0.1]])
    assert not len(fronts(seen, 2.0))
    far = driving(WEAK_M_S2)
    tell(far, 5.6, 2.6)
    assert not len(fronts(far, 0.3))
    outside = driving(WEAK_M_S2)
    tell(outside, 10.6, 3.0)
    assert not len(fronts(outside, 3.0))
    silent = driving(WEAK_M_S2)
    tell(silent, 5.6, 2.6, -4.0)
    assert not len(fronts(silent, 2.0))


def test_who_takes_long_to_stop_slows_down_for_a_mate_behind_the_doors_edge() -> None:
    """Both would see each other first where neither can stop any more."""
    alone, met = driving(WEAK_M_S2), driving(WEAK_M_S2)
    tell(met, 5.6, 2.6)
    assert told_speed(alone) > 0.96
    assert told_speed(met) == 0.0
    strong = driving(2.0)
    tell(strong, 5.6, 2.6)
    assert told_speed(strong) == told_speed(driving(2.0)) > 0.9


@pytest.mark.parametrize("v_m_s", [0.2, 0.4, 0.6, 0.8])
def test_what_it_is_told_ends_in_its_own_half_of_the_way(v_m_s: float) -> None:
    """However fast it is: half of the way to where the mate may be by now, less what both leave between."""
    edge = np.array([5.0, DOOR_Y_M + 0.5])
    for y_m in np.arange(1.6, 3.0, 0.2):
        context = driving(WEAK_M_S2, v_m_s)
        tell(context, 5.6, float(y_m))
        v = told_speed(context)
        stop_m = v * REACTS_S + 0.5 * v * v / WEAK_M_S2
        way_m = math.dist((4.5, 3.6), edge) + math.dist(edge, (5.6, y_m))
        # Straight on leads up to the edge by cos 0.3 of what is driven, less where it turns meanwhile.
        assert 0.9 * stop_m < 0.5 * (way_m + 0.25 - 2.0 * RADIUS_M - TOLD_M - GAP_M) + 0.02
