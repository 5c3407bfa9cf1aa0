"""Goals that the seed draws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.build.build import build, build_source
from pilotage.experiments.build.obstacles import Obstacles
from pilotage.experiments.mission import mission_of
from pilotage.experiments.resolve import resolved_yaml
from pilotage.experiments.run import run_mission
from pilotage.missions.mission import Mission
from pilotage.missions.world import BoxObstacle, CircleObstacle
from support.missions import MISSIONS, ROOM_MAP, reach

SIDE_M = 10.0
FRAME = [[0, 0, 10, 0], [10, 0, 10, 10], [10, 10, 0, 10], [0, 10, 0, 0]]
TWO_FLOORS: dict[str, Any] = {"map": "two floors", "walls_m": [*FRAME, [6, 0, 6, 10]]}


def world(**changes: Any) -> dict[str, Any]:
    start = {"x_m": 2.0, "y_m": 2.0}
    return {"map": TWO_FLOORS, "start": start, "random_goal": {"clearance_m": 0.5}, **changes}


def settled(seed: int = 0, team: dict[str, Any] | None = None, **changes: Any) -> Mission:
    values = reach(world=world(**changes))
    return build_source(mission_of(values | ({} if team is None else {"team": team}), seed=seed)).mission


def test_it_lies_where_the_robot_can_go_and_is_recorded() -> None:
    drawn = [settled(seed) for seed in range(20)]
    goals = [mission.world.goal for mission in drawn]
    assert all(goal is not None and 0.5 <= goal.x_m <= 5.5 and 0.5 <= goal.y_m <= 9.5 for goal in goals)
    assert len({goal.x_m for goal in goals if goal is not None}) == 20
    assert all(mission.world.random_goal is None for mission in drawn)
    assert drawn[3] == settled(3)
    assert "random_goal: null" in resolved_yaml(drawn[0])
    # Only what is asked for is drawn: the rest of the run's draws are those of any other goal.
    assert drawn[0].world.start == mission_of(reach()).world.start.model_copy(update={"theta_rad": 0.0})  # type: ignore[union-attr]


def test_a_body_that_reaches_far_begins_where_it_has_room_as_it_stands() -> None:
    """It stood in walls, and the mission was refused, wherever the draw left it less than it reaches."""
    car = {"points_m": [[1.4, 0.3], [-0.2, 0.3], [-0.2, -0.3], [1.4, -0.3]]}
    values = reach(world=world(start=None, random_start={"clearance_m": 0.4}))
    values["robot"]["footprint"] = car
    for seed in range(20):
        assert build_source(mission_of(values, seed=seed)).mission.world.start is not None


def test_it_lies_in_the_house_that_the_body_comes_to_not_in_its_yard() -> None:
    """Twelve rooms, each small beside the yard: the start was drawn on either, the goal on the other."""
    x_m, y_m = (2.0, 5.0, 8.0, 11.0, 14.0), (2.0, 5.0, 8.0, 11.0)
    walls: list[list[float]] = [[0, 0, 16, 0], [16, 0, 16, 13], [16, 13, 0, 13], [0, 13, 0, 0]]
    walls += [[2, 2, 14, 2], [14, 2, 14, 11], [14, 11, 2, 11], [2, 11, 2, 2]]
    for x in x_m[1:-1]:
        walls += [part for y in y_m[:-1] for part in ([x, y, x, y + 1], [x, y + 2.1, x, y + 3])]
    for y in y_m[1:-1]:
        walls += [part for x in x_m[:-1] for part in ([x, y, x + 1, y], [x + 2.1, y, x + 3, y])]
    house = {"map": "a house in a yard", "walls_m": walls}
    for seed in range(12):
        places = settled(seed, map=house, start=None, random_start={}, random_goal={}).world
        for place in (places.start, places.goal):
            assert place is not None
            assert 2.0 < place.x_m < 14.0
            assert 2.0 < place.y_m < 11.0


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (
            {"start": None, "random_goal": None, "goal": {"x_m": 2.0, "y_m": 2.0}},
            r"world\.random_start: \{\}",
        ),
        ({"random_goal": None}, r"world\.random_goal: \{\}"),
        (
            {"random_goal": None, "goal": {"x_m": 2.0, "y_m": 27.0}},
            r"world\.goal: null, world\.random_goal: \{\}",
        ),
        ({"start": {"x_m": 6.0, "y_m": 12.0}}, r"world\.start: null"),
    ],
    ids=["no start", "no goal", "another map's goal", "another map's start"],
)
def test_who_takes_a_mission_to_another_map_is_told_that_places_can_be_drawn(
    changes: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        build(mission_of(reach(world=world(**changes))))


@pytest.mark.parametrize(("door_m", "both"), [(0.8, True), (0.7, False)])
@pytest.mark.parametrize("begin", ["start", "random_start"])
def test_it_lies_behind_doors_that_the_body_comes_through(door_m: float, both: bool, begin: str) -> None:
    """Places were joined by passages as wide as the room around them: in houses all lay in one room."""
    wall = [[6, 0, 6, 5], [6, 5 + door_m, 6, 10]]
    rooms = {"map": "two rooms", "walls_m": [*FRAME, *wall]}
    drawn = {"start": None, "random_start": {"clearance_m": 0.6}} if begin == "random_start" else {}
    missions = [settled(seed, map=rooms, random_goal={"clearance_m": 0.6}, **drawn) for seed in range(12)]
    goals = [mission.world.goal for mission in missions]
    away = [goal is not None and goal.x_m > 6.0 for goal in goals]
    assert any(away) == both
    assert not all(away)


@pytest.mark.parametrize("heading", [None, 0.3])
def test_it_is_as_near_as_the_given_one_and_has_a_heading_where_that_has(heading: float | None) -> None:
    given_goal = {"x_m": 3.0, "y_m": 3.0, "tolerance_m": 0.1, "theta_rad": heading, "tolerance_rad": 0.2}
    goals = [settled(seed, goal=given_goal).world.goal for seed in range(5)]
    assert all(goal is not None and (goal.tolerance_m, goal.tolerance_rad) == (0.1, 0.2) for goal in goals)
    headings = {goal.theta_rad for goal in goals if goal is not None}
    assert headings == {None} if heading is None else len(headings) == 5


def test_a_team_is_sent_apart() -> None:
    team = {"size": 6, "spacing_m": 1.0}
    for seed in range(5):
        mission = settled(seed, team, random_start={"clearance_m": 0.5}, start=None)
        goals = [robot.goal for robot in mission.robots]
        starts = [robot.start for robot in mission.robots]
        places = np.array([[goal.x_m, goal.y_m] for goal in goals if goal is not None])
        begun = np.array([[start.x_m, start.y_m] for start in starts if start is not None])
        assert len(places) == len(begun) == 6
        between = np.hypot(*(places[:, None] - places).T)[~np.eye(6, dtype=bool)]
        assert between.min() >= 2 * (0.3 + 0.3)
        assert np.hypot(*(places - begun).T).min() >= 0.6


def test_it_keeps_clear_of_what_stands_there_unexpectedly() -> None:
    boxes = [{"kind": "box", "from_m": [3.0, 0.4], "to_m": [3.0, 9.6], "thickness_m": 5.2}]
    circles: list[dict[str, Any]] = [{"kind": "circle", "centre_m": [3.0, 6.0], "radius_m": 2.0}]
    for seed in range(10):
        goal = settled(seed, obstacles=circles, start={"x_m": 1.0, "y_m": 1.0}).world.goal
        assert goal is not None
        assert math.hypot(goal.x_m - 3.0, goal.y_m - 6.0) >= 2.5
    with pytest.raises(InputError, match=r"world\.obstacles: expected room beside them for a random place"):
        settled(0, obstacles=boxes)


@given(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-3.0, 3.0), st.floats(0.1, 3.0))
def test_inside_of_an_obstacle_is_no_room(x: float, y: float, turn: float, thick: float) -> None:
    along = np.round([math.cos(turn), math.sin(turn)], 6)
    along /= np.hypot(*along)
    box = BoxObstacle(
        kind="box", from_m=tuple((-along).tolist()), to_m=tuple(along.tolist()), thickness_m=thick
    )
    round_one = CircleObstacle(kind="circle", centre_m=(9.0, 0.0), radius_m=1.0)
    found = Obstacles.fixed([box, round_one]).room_m(x, y)
    off = np.array([x, y]) @ np.array([along, [-along[1], along[0]]]).T
    beyond = np.maximum(np.abs(off) - [1.0, thick / 2], 0.0)
    expected = min(math.hypot(*beyond), math.hypot(x - 9.0, y) - 1.0)
    assert found == pytest.approx(expected, abs=1e-9)


def test_where_no_goal_is_left_it_is_refused() -> None:
    with pytest.raises(InputError, match="expected random places 4 m from walls"):
        settled(random_goal={"clearance_m": 4.0})
    narrow = {"map": "narrow", "walls_m": [*FRAME, [1.2, 0, 1.2, 10], [0, 1.6, 1.2, 1.6]]}
    with pytest.raises(InputError, match=r"0\.4 m from walls and apart from the others.* less clearance_m"):
        settled(map=narrow, random_goal={"clearance_m": 0.4}, start={"x_m": 0.6, "y_m": 0.8})


def test_a_mission_that_draws_its_goal_runs_and_runs_again_as_it_was_recorded() -> None:
    values = reach(world={"map": ROOM_MAP, "start": {"x_m": 2.0, "y_m": 2.0}, "random_goal": {}})
    values["stack"]["planner"] = {"name": "theta-star"}
    values["stack"]["smoother"] = "shortcut"
    mission = mission_of(values, seed=2)
    first, again = (
        {
            key: value
            for key, value in run_mission(one, save=False).metrics.items()
            if not METRICS.is_wall_clock(key)
        }
        for one in (mission, build(mission).mission)
    )
    assert first["success"]
    assert first == again


def test_a_task_that_wants_no_goal_says_so() -> None:
    with pytest.raises(InputError, match=r"expected no world\.goal"):
        build(mission_of(MISSIONS["follow"] | {"world": world(map=ROOM_MAP)}))
