"""Robots on patrol that take long to stop: how fast they come to bends, and when they are held up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.kernels.control.bends import narrow_bend_m
from pilotage.stack.navigator.patrol.approach import Approach
from pilotage.stack.navigator.patrol.states import transitions
from support.two_rooms import DOOR_Y_M, roadmap_of, two_rooms


def way(half_width_m: float) -> FloatArray:
    """Two metres ahead, then to the left through a place of this half width."""
    ahead = [[0.25 * k, 0.0, 2.0] for k in range(9)]
    return np.array([*ahead, *([2.0, 0.25 * k, half_width_m] for k in range(1, 5))])


@pytest.mark.parametrize(
    ("half_width_m", "theta", "bend_m"), [(0.5, 0.0, 2.0), (0.5, math.pi / 2, math.inf), (1.0, 0.0, math.inf)]
)
def test_bends_count_where_it_is_narrow(half_width_m: float, theta: float, bend_m: float) -> None:
    assert narrow_bend_m(way(half_width_m), theta, 0.4, 0.75) == pytest.approx(bend_m)


def speed_before_the_door(y_m: float, theta: float, braking_m_s2: float) -> float:
    """Of 1.2 m/s, in front of the wall between two rooms, bound for the other one."""
    roadmap = roadmap_of(DOOR_Y_M)
    behind = roadmap.time_s(int(np.argmax(roadmap.places_xy_m[:, 0])))
    return Approach(1.2, braking_m_s2, 1.2, 0.76).speed_m_s(roadmap, Pose2(4.3, y_m, theta), behind, -1)


def test_weak_brakes_slow_down_before_a_door_beside_their_way() -> None:
    along_wall = -math.pi / 2
    assert speed_before_the_door(1.6, along_wall, 2.0) == 1.2
    assert speed_before_the_door(1.6, along_wall, 0.3) < 1.1


def set_out(braking_m_s2: float) -> Any:
    values = two_rooms(DOOR_Y_M)
    values["robot"]["motion"]["max_acceleration_m_s2"] = braking_m_s2
    stack: Any = build(mission_of(values, seed=0)).team[1].stack
    return transitions.set_out(stack._context)


def test_who_turns_back_for_long_is_not_held_up_meanwhile() -> None:
    """At 0.3 m/s^2 it takes 6.7 s to come to rest from 1 m/s and to come back as fast."""
    weak, strong = (set_out(braking_m_s2).watch for braking_m_s2 in (0.3, 2.0))
    assert not weak.stalled(5.0, 0.0)
    assert not weak.stalled(5.0, 6.6)
    assert not strong.stalled(5.0, 0.0)
    assert strong.stalled(5.0, 9.1)
