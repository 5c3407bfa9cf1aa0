"""A robot on patrol with mates close around it: it leaves where there is room."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import STOP, FloatArray, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission

RADIUS_M = 0.3


@pytest.fixture(scope="module")
def context() -> Any:
    """Of one of two in a hall of 8 m x 6 m."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 8, 0], [0, 0, 0, 6], [8, 0, 8, 6], [0, 6, 8, 6]]
    values["world"] = {"map": {"map": "hall", "bounds_m": [0, 0, 8, 6], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": 10.0, "derive": {"reach_m": 4.0}}
    values["team"] = {"size": 2, "strategy": "cyclic", "radio": {}}
    values["run"]["time_limit_s"] = 10.0
    stack: Any = build(mission_of(values, seed=0)).team[0].stack
    return stack._context


def returns_of_mate(bearing_rad: float, gap_m: float) -> FloatArray:
    """(K, 2) the near side of a mate's body, base frame."""
    away_m = 2.0 * RADIUS_M + gap_m
    angle = bearing_rad + math.pi + np.radians(np.arange(-80.0, 81.0, 5.0))
    middle = away_m * np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    return middle + RADIUS_M * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(("x_m", "y_m"), [(4.0, 3.0), (4.03, 3.04), (4.07, 2.95)])
def test_who_has_mates_before_it_and_to_both_sides_turns_to_where_it_may_leave(
    context: Any, x_m: float, y_m: float
) -> None:
    """Nearer than paths lead past them, no node was left for one to begin at, and it stood."""
    bearings = (0.0, 0.5 * math.pi, -0.5 * math.pi)
    context.pose, context.twist, context.fresh = Pose2(x_m, y_m, 0.0), STOP, True
    context.strange = np.concatenate([returns_of_mate(bearing, 0.11) for bearing in bearings])
    command = context.motion.descend(context.roadmap.field_to(6.5, 3.0))
    assert abs(command.w_rad_s) > 1.0
    assert not context.motion.blocked
