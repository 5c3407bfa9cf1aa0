"""Two whose brakes are unlike meet head-on: what the weaker one still needs is not the other one's half."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.kernels.control import disc_returns, safe_stop
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.word import Talk, TeamWord
from support.two_rooms import DOOR_Y_M, two_rooms

PERIOD, REACTION, RADIUS, GAP = 0.1, 0.15, 0.25, 0.1
NOBODY, NO_MAP = np.zeros((0, 2)), (np.zeros((1, 1)), 0.0, 0.0, 0.1)
CASES = [
    (apart_m, weak_m_s2, weak_m_s, strong_m_s)
    for apart_m, weak_m_s2, weak_m_s, strong_m_s in product(
        (3.4, 5.0, 8.0), (0.3, 0.5), (0.8, 1.1), (0.7, 1.3)
    )
    if weak_m_s * REACTION + 0.5 * weak_m_s**2 / weak_m_s2 < 0.6 * apart_m
]
"""Not those where it is too fast for what it sees, whatever the other one does."""


def told_m_s(v_m_s: float, top_m_s: float, braking_m_s2: float, seen_m: FloatArray) -> float:
    """The fastest that one may be told who sees others ahead, and goes as fast as it may."""
    limits = np.array([top_m_s, braking_m_s2, braking_m_s2, 2.0, 8.0, PERIOD])
    safety = np.array([REACTION, RADIUS, 0.06, GAP, 1.4])
    change = braking_m_s2 * PERIOD
    for v in np.linspace(min(top_m_s, v_m_s + change), max(0.0, v_m_s - change), 21).tolist():
        seen = NOBODY, seen_m, NOBODY
        if safe_stop.stop_is_clear(v_m_s, 0.0, v, 0.0, limits, safety, seen, np.zeros(3), NO_MAP):
            return float(v)
    return max(0.0, v_m_s - change)


def least_gap_m(
    apart_m: float, tops_m_s: tuple[float, float], brakings: tuple[float, float], *, heeds: bool
) -> float:
    """Between two that come straight at each other and see each other once they are so far apart."""
    at, v = [0.0, apart_m + 2.0 * RADIUS], list(tops_m_s)
    before_m: FloatArray | None = None
    least = apart_m
    for _ in range(200):
        front = np.array([[at[1] - at[0] - RADIUS, 0.0]])
        weak = told_m_s(v[0], tops_m_s[0], brakings[0], front)
        seen = front
        if heeds and before_m is not None:
            # What was seen then, where it is from here.
            before = before_m - [[v[1] * PERIOD, 0.0]]
            nearer = disc_returns.rolling_on(
                front, before, PERIOD, 0.5, 0.05, RADIUS, GAP, REACTION, np.array(brakings[:1])
            )
            seen = np.concatenate([front, nearer])
        strong = told_m_s(v[1], tops_m_s[1], brakings[1], seen)
        before_m = front
        for k, told in enumerate((weak, strong)):
            new = safe_stop.toward(v[k], told, brakings[k] * PERIOD)
            at[k] += (1 - 2 * k) * 0.5 * (v[k] + new) * PERIOD
            v[k] = new
        least = min(least, at[1] - at[0] - 2.0 * RADIUS)
    return least


@pytest.mark.parametrize(("apart_m", "weak_m_s2", "weak_m_s", "strong_m_s"), CASES)
def test_who_heeds_what_the_other_still_needs_does_not_touch_it(
    apart_m: float, weak_m_s2: float, weak_m_s: float, strong_m_s: float
) -> None:
    assert least_gap_m(apart_m, (weak_m_s, strong_m_s), (weak_m_s2, 2.0), heeds=True) > 0.02


def test_halves_alone_are_not_enough_for_unlike_brakes() -> None:
    assert least_gap_m(8.0, (1.1, 1.3), (0.3, 2.0), heeds=False) < 0.0
    assert least_gap_m(8.0, (1.1, 1.3), (2.0, 2.0), heeds=False) > 0.05


def context_of(*brakings_m_s2: float) -> Any:
    """The second of a team, at (2, 3), with brakes by their data sheets."""
    values = two_rooms(DOOR_Y_M)
    for robot, braking_m_s2 in zip(values["robots"], brakings_m_s2, strict=True):
        robot["motion"] = values["robot"]["motion"] | {"max_acceleration_m_s2": braking_m_s2}
    stack: Any = build(mission_of(values, seed=0)).team[1].stack
    context = stack._context
    context.fresh, context.t_s = True, 1.0
    return context


def tell(context: Any, number: int, x_m: float, braking_m_s2: float | None) -> None:
    """A mate says where it is, and how it brakes."""
    news = PatrolMemory(2, number, 3, 0, 1.0).message(0.0)
    talk = Talk(1.0, 60.0, 0.0, 1.0)
    context.hear(1.0, TeamWord(x_m, 3.0, False, None, None, news, 0.3, talk=talk, braking_m_s2=braking_m_s2))


def test_the_weakest_is_who_may_be_near_by_what_it_told_or_its_data_sheet() -> None:
    context = context_of(0.5, 2.0, 1.0)

    def weakest() -> list[float]:
        found = context.weaker_m_s2(np.array([[3.0, 3.3], [7.8, 3.0]]), 1.5)
        return [float(braking) for braking in found]

    assert weakest() == [0.5, 0.5], "nobody was heard: each may be anywhere"
    tell(context, 0, 8.0, None)
    assert weakest() == [1.0, 0.5], "the weakest is told to be far away from the first place"
    tell(context, 2, 3.0, 0.4)
    assert weakest() == [0.4, 0.5], "its brakes have proved to be weaker"
    tell(context, 2, 3.0, 1.8)
    assert weakest() == [math.inf, 0.5], "its brakes are as good as one's own"


@pytest.mark.parametrize(("mate_m_s2", "slower"), [(0.3, True), (2.0, False)])
def test_who_comes_on_weak_brakes_is_given_more_than_half(mate_m_s2: float, slower: bool) -> None:
    """At 1 m/s it needs 1.8 m of the 2.1 m to where it is seen."""
    context = context_of(mate_m_s2, 2.0, 2.0)
    context.pose, context.twist = Pose2(2.0, 3.0, 0.0), Twist(1.0, 0.0)
    for t_s, away_m in ((1.0, 2.6), (1.1, 2.5)):
        context.t_s, context.strange = t_s, np.array([[away_m, 0.0]])
        context.motion.watch(lost=False)
    fronts = context.motion._fronts
    assert len(fronts) == slower
    if slower:
        free_m = float(fronts[0, 0]) - context.radius_m - context.config.gap_m
        needs_m = 1.0 * context.motion._meets._reaction_s + 0.5 / mate_m_s2
        assert free_m == pytest.approx(2.0 * max(2.1 - needs_m, 0.0), abs=0.02)
        assert math.isclose(float(fronts[0, 1]), 0.0)
