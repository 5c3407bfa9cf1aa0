"""Navigator `local` along a plan: around what is on no map, and what it says where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from pilotage.evaluation.least_time import least_time_s
from pilotage.evaluation.shortest_path import shortest_path
from pilotage.experiments.mission import load_mission, mission_of, read_mission
from pilotage.experiments.run import run_mission
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.missions.mission import Mission
from pilotage.stack.navigator.navigator import arrival_within_m

WALLS = [[0, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0], [4, 0, 4, 4.4]]
ROOMS = {
    "map": "two-rooms",
    "bounds_m": [0, 0, 8, 6],
    "walls_m": WALLS,
}
BOX = {"kind": "box", "from_m": [1.8, 3.2], "to_m": [3.0, 2.0], "thickness_m": 0.2}


def mission(obstacles: Sequence[object] = (BOX,), **more: object) -> Mission:
    settings = {
        "world.map": ROOMS,
        "world.start": {"x_m": 1.0, "y_m": 1.0, "theta_rad": 0.0},
        "world.goal": {"x_m": 7.0, "y_m": 1.0},
        "world.obstacles": list(obstacles),
        "stack.localizer": {"name": "dead-reckoning"},
        "stack.initial": {"x_var_m2": 1e-8, "y_var_m2": 1e-8, "theta_var_rad2": 1e-8},
        "robot.sensors.beacons": None,
        "run.time_limit_s": 60.0,
        **more,
    }
    return mission_of(read_mission("museum-1-fast"), (), 0, settings)


def driven(mission: Mission) -> dict[str, Any]:
    return dict(run_mission(mission, save=False).metrics)


def test_it_drives_around_what_is_on_no_map_and_is_held_against_the_least() -> None:
    metrics = driven(mission())
    assert metrics["success"], metrics["reason"]
    box = box_segments(2.4, 2.6, 1.2 * math.sqrt(2.0), 0.2, -0.25 * math.pi)
    world = SegmentMap(np.vstack([np.array(WALLS), box]), np.zeros((0, 3)), (0.0, 0.0, 8.0, 6.0))
    assert world.distance_m(2.4, 2.6) < 0.2  # it stands on the straight path
    least = shortest_path(world, (1.0, 1.0), (7.0, 1.0), 0.3)
    assert least is not None
    assert metrics["least_length_m"] == pytest.approx(least.length_m - 0.3)
    assert metrics["least_time_s"] == pytest.approx(least_time_s(metrics["least_length_m"], 1.0, 2.0))
    assert metrics["driven_over_least"] < 1.15
    assert 1.0 <= metrics["time_over_least"] < 1.35


def test_who_was_carried_is_held_against_no_least_way() -> None:
    away = {"world.kidnaps": [{"at_s": 1.0, "to": {"x_m": 7.0, "y_m": 2.0, "theta_rad": 0.0}}]}
    assert "driven_over_least" in driven(mission((), **{"run.time_limit_s": 3.0}))
    assert "driven_over_least" not in driven(mission((), **away, **{"run.time_limit_s": 3.0}))


def test_without_a_plan_it_ends_and_says_so() -> None:
    closed = {**ROOMS, "walls_m": [*WALLS, [4, 4.4, 4, 6]]}
    metrics = driven(mission((), **{"world.map": closed}))
    assert not metrics["success"]
    assert metrics["reason"].startswith("no plan leads to the goal: ")
    assert "least_length_m" not in metrics


def test_who_never_drove_is_held_against_no_least_way() -> None:
    """A run without a plan had driven 0.000 of the least path in 0.000 of its time: the best there can be."""
    wide = {
        "stack.planner": {"name": "rrt-star-dubins", "iterations": 1},
        "stack.navigator": {"name": "goal"},
    }
    parts = {
        "stack.local_controller": None,
        "stack.local_planner": "dubins",
        "stack.controller": "pi-follower",
    }
    metrics = driven(mission((), **wide, **parts))
    assert not metrics["success"]
    assert metrics["steps"] == 0
    assert metrics["least_length_m"] > 6.0
    assert not {"driven_over_least", "time_over_least"} & metrics.keys()


def test_where_the_way_is_shut_by_what_it_finds_it_gives_up_and_says_so() -> None:
    shut = {"kind": "box", "from_m": [4.0, 4.4], "to_m": [4.0, 6.0], "thickness_m": 0.2}
    more = {
        "stack.navigator": {"name": "local", "plan": {"stall_s": 2.0, "most_stalls": 1}},
        "run.time_limit_s": 90.0,
    }
    metrics = driven(mission((shut,), **more))
    assert not metrics["success"]
    stuck = "stuck: no progress on 2 plans; planning found no path (no path over the grid's nodes keeps 0.3 m"
    assert metrics["reason"].startswith(stuck)
    assert metrics["collisions"] == 0


def test_a_tight_passage_is_taken_where_a_wide_one_is_far() -> None:
    """What it finds leaves 0.85 m of the way ahead: too little for its clearance, enough for its body."""
    two = {**ROOMS, "walls_m": [*WALLS[:4], [4, 1.6, 4, 4.4]]}
    box = {"kind": "box", "from_m": [4.0, 1.6], "to_m": [4.0, 0.85], "thickness_m": 0.2}
    metrics = driven(mission((box,), **{"world.map": two}))
    assert metrics["success"], metrics["reason"]
    assert metrics["driven_over_least"] < 1.10


def test_the_museum_is_driven_past_a_trap_near_the_least() -> None:
    metrics = driven(load_mission("museum-concave-fast", [], 0))
    assert metrics["success"], metrics["reason"]
    assert metrics["replans"] > 0
    assert metrics["driven_over_least"] < 1.10
    assert metrics["time_over_least"] < 1.20
    assert math.isfinite(metrics["least_time_s"])


def test_goal_turns_away_from_what_it_sees_on_its_plan_where_it_is_told_to() -> None:
    """Else it does as the report's robot: drives up to it and reacts."""
    metrics = driven(load_mission("museum-1", [], 1))
    assert metrics["success"]
    assert metrics["attempts"] > 0
    metrics = driven(load_mission("museum-1", ["stack.navigator.watch_plan_s=1"], 1))
    assert metrics["success"]
    assert metrics["replans"] > 0
    assert metrics["attempts"] == 0
    assert metrics["driven_over_least"] < 1.05


def test_before_a_wall_it_plans_from_another_heading() -> None:
    """The robot turns where it stands; the planner's forward curves of 0.5 m would end in the wall."""
    facing = {"x_m": 0.55, "y_m": 1.0, "theta_rad": math.pi}
    metrics = driven(mission((), **{"world.start": facing, "stack.planner": {"name": "rrt-star-dubins"}}))
    assert metrics["success"], metrics["reason"]


def test_it_goes_within_half_the_tolerance_of_the_task_s_points() -> None:
    task = {"name": "follow", "points_m": [[3.0, 1.0]], "tolerance_m": 0.2}
    metrics = driven(mission((), **{"world.goal": None, "task": task, "stack.navigator.arrival_m": None}))
    assert metrics["success"], metrics["reason"]
    assert metrics["reason"] == "within 0.1 m of the goal"


def test_how_near_it_has_to_believe_to_be() -> None:
    assert arrival_within_m(None, 0.3) == pytest.approx(0.15)
    assert arrival_within_m(0.05, 0.3) == pytest.approx(0.05)
    assert arrival_within_m(0.5, 0.3) == pytest.approx(0.3)


def test_a_given_route_is_held_against_no_shortest_path() -> None:
    """The programmed route ends beside where it begins: it was 164 times the least way."""
    metrics = driven(load_mission("museum-route", ["run.time_limit_s=2"], 0))
    assert metrics["planned_length_m"] > 60.0
    assert "driven_over_least" not in metrics
