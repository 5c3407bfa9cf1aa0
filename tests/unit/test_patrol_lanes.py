"""Robots on patrol keep to the right where they may meet a mate, and to the middle elsewhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.word import Talk, TeamWord

LENGTH_M, WIDTH_M = 24.0, 3.0


def in_a_hall(team: int, radio_m: float = 60.0) -> Any:
    """The first of a team, in the middle of a hall with room for two, bound for its end at full speed."""
    corners = [[0, 0, LENGTH_M, 0], [LENGTH_M, 0, LENGTH_M, WIDTH_M]]
    corners += [[LENGTH_M, WIDTH_M, 0, WIDTH_M], [0, WIDTH_M, 0, 0]]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "hall", "bounds_m": [0, 0, LENGTH_M, WIDTH_M], "walls_m": corners}}
    values["task"] = {"name": "patrol", "duration_s": 60.0, "derive": {"reach_m": 3.0}}
    values["team"] |= {"size": team, "radio": {"range_m": radio_m, "loss": 0.3}}
    values["run"]["time_limit_s"] = 60.0
    stack: Any = build(mission_of(values, seed=0)).team[0].stack
    context = stack._context
    context.pose, context.twist, context.fresh = Pose2(8.0, 0.5 * WIDTH_M, 0.0), Twist(1.0, 0.0), True
    context.t_s = 1.0
    return context


def tell(context: Any, number: int, x_m: float, sent_s: float = 1.0, radio_m: float = 60.0) -> None:
    """A mate says that it is in the middle of the hall."""
    talk = Talk(speed_m_s=1.0, reach_m=radio_m, loss=0.3, period_s=1.0)
    news = PatrolMemory(2, number, len(context.task.starts), 0, 1.0).message(sent_s)
    context.hear(sent_s, TeamWord(x_m, 0.5 * WIDTH_M, False, None, None, news, 0.3, talk=talk))


def wait(context: Any, until_s: float) -> None:
    """Nothing is said meanwhile."""
    for k in range(round(10 * context.t_s), round(10 * until_s) + 1):
        context._last_words.step(0.1 * k, context.pose, context.talk_habit, lost=False)
    context.t_s = until_s


def turns(context: Any) -> float:
    """What it is told, on its way to the far end."""
    context.motion.watch(lost=False)
    return float(context.lead(int(np.argmax(context.roadmap.places_xy_m[:, 0]))).w_rad_s)


def test_who_is_alone_drives_along_the_middle() -> None:
    assert abs(turns(in_a_hall(1))) < 0.1


@pytest.mark.parametrize(("x_m", "keeps_right"), [(12.0, True), (3.5, True), (20.0, False)])
def test_a_lane_is_kept_where_a_mate_is_near(x_m: float, *, keeps_right: bool) -> None:
    context = in_a_hall(2)
    tell(context, 1, x_m)
    w = turns(context)
    assert w < -0.15 if keeps_right else abs(w) < 0.1


def test_who_was_not_heard_lately_may_be_anywhere() -> None:
    never, context, late = in_a_hall(3), in_a_hall(3), in_a_hall(3)
    for number in (1, 2):
        tell(context, number, 20.0)
        tell(late, number, 20.0)
    wait(late, 30.0)
    assert turns(never) < -0.15
    assert abs(turns(context)) < 0.1
    assert turns(late) < -0.15


def test_a_mate_that_may_have_come_near_since_is_reckoned_with() -> None:
    context = in_a_hall(2)
    tell(context, 1, 15.5, sent_s=1.0)
    assert not context.may_meet_mates(6.0)
    context.t_s = 3.0
    assert context.may_meet_mates(6.0)
    context.pose = Pose2(math.nan, math.nan, math.nan)
    assert context.may_meet_mates(6.0)


@pytest.mark.parametrize(("radio_m", "keeps_right"), [(11.0, False), (60.0, True), (7.0, True)])
def test_who_left_the_radios_reach_is_not_near(radio_m: float, *, keeps_right: bool) -> None:
    """Whose silence is a wonder may have lost its radio; where radios reach no farther than lanes begin,
    nobody is heard before he is met."""
    context = in_a_hall(2, radio_m)
    tell(context, 1, 19.5, radio_m=radio_m)
    wait(context, 40.0)
    assert context.may_meet_mates(6.0) is keeps_right
