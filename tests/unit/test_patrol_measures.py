"""What counts as a visit and as seen on patrol: a body that stands there is no guard."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission

FAILS_S, END_S = 2.0, 6.0


@pytest.mark.parametrize("mended", [False, True])
def test_who_failed_neither_visits_nor_sees_until_it_is_mended(*, mended: bool) -> None:
    """The place under its body was never idle, and the floor around it covered for good."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0]]
    values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 6, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": END_S}
    failure = {"robot": 0, "at_s": FAILS_S} | ({"for_s": 3.0} if mended else {})
    values["team"] = {"size": 1, "strategy": "cyclic", "failures": [failure]}
    experiment = build(mission_of(values, seed=0))
    assert experiment.task.judge(run_loop(experiment).finished).metrics["robots_failed"] == (not mended)
    task: Any = experiment.task
    for last_s in (task._visits.last_s, task._floor.seen_s):
        assert last_s.max() == pytest.approx(END_S if mended else FAILS_S, abs=0.41)
    # Who is there at the end and failed long ago has not stayed.
    worst_s = task._visits.idleness(END_S, 0.0)[0].vertex_worst_s
    assert mended or worst_s.min() >= END_S - FAILS_S - 0.41


@pytest.mark.parametrize("dead", [0, 1, 2])
def test_a_patrol_goes_on_without_some_and_not_without_all(dead: int) -> None:
    """All robots dead, from the first minute of an hour on, was told as a success of every one of them."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0]]
    values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 6, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": END_S}
    failures = [{"robot": robot, "at_s": FAILS_S} for robot in range(dead)]
    values["team"] = {"size": 2, "strategy": "cyclic", "failures": failures}
    experiment = build(mission_of(values, seed=0))
    metrics: Any = experiment.task.judge(run_loop(experiment).finished).metrics
    assert metrics["success"] == (dead < 2)
    assert [own["success"] for own in metrics["robots"].values()] == [dead < 1, dead < 2]
    assert ("dead" in metrics["reason"]) == (dead > 0)
    assert metrics["robots_failed"] == dead


def test_what_either_of_two_lasers_sees_is_seen() -> None:
    """The floor behind a robot counted as unseen for ever where its laser in front came first."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0]]
    values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 6, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": END_S}
    values["team"] = {"size": 1, "strategy": "cyclic", "starts": [{"x_m": 3.0, "y_m": 2.5, "theta_rad": 0.0}]}
    del values["robot"]["sensors"]["lidar"]
    half = {"name": "lidar", "rate_hz": 5, "beams": 181, "field_of_view_rad": 3.5}
    values["robot"]["sensors"] |= {"front": half, "back": {**half, "mount": {"theta_rad": math.pi}}}
    experiment = build(mission_of(values, seed=0))
    metrics: Any = experiment.task.judge(run_loop(experiment).finished).metrics
    assert metrics["coverage_age_worst_s"] < 1.0


def test_a_derived_graph_reckons_with_the_shortest_laser() -> None:
    """Every place was taken to see 8 m: with lasers of 2 m a quarter of the floor was never seen."""

    def vertices(laser_m: float, **derive: float) -> Any:
        values = read_mission("museum-patrol")
        walls = [[0, 0, 9, 0], [9, 0, 9, 7], [9, 7, 0, 7], [0, 7, 0, 0]]
        values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 9, 7], "walls_m": walls}}
        values["robot"]["sensors"]["lidar"]["max_range_m"] = laser_m
        values["task"] = {"name": "patrol", "derive": derive}
        values["team"]["size"] = 1
        task: Any = build(mission_of(values, seed=0)).task
        return task.patrol.graph.vertices_xy_m, task._floor.cells_xy_m

    places, cells = vertices(2.0)
    away_m = np.hypot(*(cells[:, None] - places).transpose(2, 0, 1)).min(axis=1)
    assert away_m.max() <= 2.0  # also from half a metre beside each place
    assert len(vertices(9.0)[0]) == len(vertices(20.0)[0]) == 1
    assert len(vertices(2.0, reach_m=8.0)[0]) == 1  # what is said stands


def test_a_visit_nearer_than_nodes_lie_says_so() -> None:
    """It was told that a wall was there."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0]]
    values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 6, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "visit_m": 1e-9}
    values["team"] = {"size": 1, "strategy": "cyclic"}
    with pytest.raises(InputError, match=r"within 5e-10 m of vertex 0 .* or a larger task\.visit_m"):
        build(mission_of(values, seed=0))
