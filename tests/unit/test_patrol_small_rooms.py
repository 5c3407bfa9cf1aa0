"""Robots on patrol get along in small rooms behind narrow doors nearly as fast as they can drive."""

from __future__ import annotations

from typing import Any

import pytest

from pilotage.experiments.mission import mission_of, read_mission
from pilotage.experiments.run import run_mission
from pilotage.stack.navigator.patrol.approach import horizon_s

DOOR_M = 0.8


def flat() -> dict[str, Any]:
    """A corridor of 1.2 m between two rows of three rooms of 3 m x 3 m, each behind a door of 0.8 m."""
    walls: list[list[float]] = [[0, 0, 9, 0], [9, 0, 9, 7.2], [9, 7.2, 0, 7.2], [0, 7.2, 0, 0]]
    for y, beyond in ((3.0, 0.0), (4.2, 7.2)):
        walls += [[3, beyond, 3, y], [6, beyond, 6, y]]
        for left in (0.0, 3.0, 6.0):
            door = left + 1.1
            walls += [[left, y, door, y], [door + DOOR_M, y, left + 3.0, y]]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "flat", "bounds_m": [0, 0, 9, 7.2], "walls_m": walls}}
    values["task"] = {"name": "patrol"}
    values["team"]["size"] = 1
    values["run"]["time_limit_s"] = 240.0
    return values


def test_laps_of_a_flat_take_little_longer_than_their_length_at_full_speed() -> None:
    """With arcs of 0.9 s and in a lane they took 1.21 to 1.24 times as long."""
    metrics: dict[str, Any] = dict(run_mission(mission_of(flat(), seed=1), save=False).metrics)
    assert metrics["collisions"] == 0
    assert metrics["idleness_worst_s"] < 1.16 * metrics["idleness_bound_s"]


@pytest.mark.parametrize(
    ("top_m_s", "braking_m_s2", "seconds"),
    [(1.0, 2.0, 0.6), (0.4, 1.0, 0.6), (2.0, 2.0, 0.6), (1.0, 0.6, 0.6), (1.0, 0.4, 0.9)],
)
def test_who_takes_long_to_stop_looks_farther_ahead(
    top_m_s: float, braking_m_s2: float, seconds: float
) -> None:
    assert horizon_s(top_m_s, braking_m_s2, reacts_s=0.25) == seconds
