"""Robots on patrol that came through a gap too narrow for plans drive back to where paths lead from."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.core.types import Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from support.two_rooms import DOOR_Y_M, two_rooms


def context_beyond_a_gap() -> Any:
    """Of a robot of 0.9 m, which plans want 1.06 m for, in the room behind a door of 1 m."""
    values = two_rooms(DOOR_Y_M)
    values["robot"]["footprint"] = {"radius_m": 0.45}
    values["robots"], values["team"]["failures"] = [{"start": {"x_m": 2.0, "y_m": 3.0, "theta_rad": 0.0}}], []
    stack: Any = build(mission_of(values, seed=0)).team[0].stack
    context = stack._context
    context.pose = Pose2(8.0, 3.0, 0.0)
    return context


def test_the_way_back_leads_through_the_gap() -> None:
    context = context_beyond_a_gap()
    assert context.is_off_roadmap()
    back = context.way_back()
    way = context.roadmap.way(8.0, 3.0, back, 20.0)[:, :2]
    at_door = way[np.argmin(np.abs(way[:, 0] - 5.0))]
    assert np.hypot(*(at_door - [5.0, DOOR_Y_M])) < 0.2
    assert way[-1, 0] < 4.9
    assert context.way_back() is back


def test_there_is_none_where_the_body_does_not_fit() -> None:
    context = context_beyond_a_gap()
    context.radius_m = 0.6
    assert context.way_back() is None
