"""The goal navigator's states: several goals in order, a start that is not known, ends that stay ends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Goal, Pose2, Twist
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.geometry import chain
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint
from pilotage.sensors.readings import Readings
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.control.pi_follower import PiFollower, PiFollowerConfig
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.localization.ekf_landmarks import EkfLandmarkLocalizer
from pilotage.stack.localization.landmark_filter import LandmarkFilterConfig
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.mapping.obstacle_layer import ObstacleLayer, ObstacleLayerConfig
from pilotage.stack.navigator.goal import GoalNavigator
from pilotage.stack.navigator.goal.driving import Following, _reach
from pilotage.stack.navigator.goal.escaping import replan
from pilotage.stack.navigator.goal_config import GoalNavigatorConfig, Mode
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.dubins_local import DubinsLocalConfig, DubinsLocalPlanner
from pilotage.stack.planning.planner import PLANNERS
from pilotage.stack.planning.rrt_star_dubins import RrtStarDubinsConfig, RrtStarDubinsPlanner
from support.missions import reach
from support.robots import ROOM, Told, sensors, told_of
from support.worlds import DISC, ROOM_MAP, Alone, alone, robot, walled

START = Pose2(2.0, 2.0, 0.0)


class Stub:
    """A localizer that believes what it is told to."""

    def __init__(self, belief: Belief) -> None:
        self.belief = belief

    def step(self, readings: Readings) -> Belief:  # noqa: ARG002
        return self.belief


class MapsNothing:
    """A mapper of one's own."""

    circles_m = np.zeros((0, 3))

    def step(self, readings: Readings, belief: Belief) -> bool:  # noqa: ARG002
        return False


def navigator(told: Told, localizer: object, mapper: Mapper | None = None) -> GoalNavigator:
    """Put together from the plainest parts."""
    parts = Parts(
        localizer=localizer,  # type: ignore[arg-type]
        planner=RrtStarDubinsPlanner(RrtStarDubinsConfig(clearance_m=0.4, iterations=2000)),
        smoother=None,
        local_planner=DubinsLocalPlanner(DubinsLocalConfig(), told.robot),
        controller=PiFollower(PiFollowerConfig(), told.robot),
        reactive=None,
        mapper=mapper,
        escape=None,
    )
    return told.navigator(GoalNavigator, GoalNavigatorConfig(), parts)


def test_several_goals_are_visited_in_order() -> None:
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    goals = (Goal(3.5, 6.0), Goal(8.0, 6.0), Goal(8.0, 2.0))
    told = replace(told, task=replace(told.task, goals=goals))
    stack = navigator(told, told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig()))
    assert told.journal.counts["goals"] == 0
    sim = alone(robot(sensors(), start=START, seed=0))
    command, nearest = STOP, [math.inf] * 3
    for _ in range(900):
        command = stack.step(sim.step(command))
        away = [math.hypot(sim.truth.x_m - goal.x_m, sim.truth.y_m - goal.y_m) for goal in goals]
        nearest = [min(pair) for pair in zip(nearest, away, strict=True)]
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert stack.status[0] is StackStatus.ARRIVED
    assert max(nearest) < 0.3
    assert away[-1] < 0.3
    assert told.journal.counts["goals"] == 2, "the last one is the arrival"
    assert [event.kind for event in told.journal.events] == ["plan", "goal", "goal", "arrived"]
    assert len(told.journal.plans) == 3
    assert stack.step(sim.step(STOP)) == STOP
    assert told.said["mode"] == Mode.ARRIVED


def test_new_plans_on_the_way_to_one_goal_do_not_count_on_the_way_to_the_next() -> None:
    """Of eight goals in narrow rooms it gave up the fifth after 30 new plans on the way to all."""
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    told = replace(told, task=replace(told.task, goals=(Goal(3.0, 2.0), Goal(3.5, 6.0))))
    stack = navigator(told, told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig()))
    context = stack._context
    context.tries = context.config.max_replans
    _reach(context, Following(context), Pose2(3.0, 2.0, 0.0))
    assert len(context.goals) == 1
    replan(context, Following(context), Pose2(3.0, 2.0, 0.0), "something stands there")
    assert context.status is StackStatus.RUNNING


def test_a_path_that_ends_at_the_rim_of_the_tolerance_has_not_reached_the_goal() -> None:
    """It believed to be 0.298 m away, said that it had arrived within 0.3 m, and stood 0.304 m away."""
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    told = replace(told, task=replace(told.task, goals=(Goal(8.0, 6.0),), goal_tolerance_m=0.3))
    context = navigator(told, told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig()))._context
    for to_go_m, off_m, there in ((0.0, 0.298, False), (0.0, 0.2, True), (0.2, 0.2, False), (0.2, 0.1, True)):
        context.to_go_m = to_go_m
        assert context.near_goal(Pose2(8.0 - off_m, 6.0, 0.0)) == there


def test_who_goes_around_nobody_says_so_among_others() -> None:
    """Two that came towards each other collided, and no word of it."""
    for mates, said in ((0, []), (1, ["another robot drives about"]), (3, ["3 others drive about"])):
        told = told_of(start=START)
        told = replace(told, task=replace(told.task, mates=mates))
        navigator(told, Stub(told.initial))
        words = [event.text for event in told.journal.events if event.kind == "mates-unseen"]
        assert [word.split(",")[0] for word in words] == said


@pytest.mark.parametrize("maps", [True, False])
def test_who_maps_nothing_of_what_stands_says_so_among_others(maps: bool) -> None:
    """A mate that stood was driven into, and no word of it; a disc stands where no map shows one."""
    told = told_of(start=START)
    told = replace(told, task=replace(told.task, mates=1))
    layer = ObstacleLayer(ObstacleLayerConfig(), told.robot, told.chart)
    stack = navigator(told, Stub(told.initial), layer if maps else MapsNothing())
    world = World.of(ROOM_MAP, obstacle_circles_m=np.array([[START.x_m + 1.5, START.y_m, 0.3]]))
    sim = Simulator(world, [robot(sensors(), start=START)], told.robot.dt_s)
    for _ in range(35):
        stack.step(sim.step([STOP])[0])
    words = [event.text for event in told.journal.events if event.kind == "mates-unseen"]
    if maps:
        assert words == []
    else:
        assert len(words) == 1
        assert "stack.mapper puts nothing on the map of what stands 1." in words[0]


def test_a_robot_that_starts_lost_plans_once_it_knows_where_it_is() -> None:
    lost = Belief.anywhere(ROOM.bounds_m)
    told = told_of(initial=lost)
    stub = Stub(lost)
    stack = navigator(told, stub)
    assert told.journal.plans == []
    stack.step(Readings(0.1, {}))
    stack.step(Readings(0.2, {}))
    assert told.said["mode"] == Mode.WANDER
    stub.belief = Belief(START, 1e-4 * np.eye(3))
    assert stack.step(Readings(0.3, {})) == STOP
    assert [event.kind for event in told.journal.events] == ["lost", "found"]
    stub.belief = replace(lost, status=BeliefStatus.LOST)
    stack.step(Readings(0.4, {}))
    assert [event.kind for event in told.journal.events] == ["lost", "found", "lost"]


def test_a_pose_found_at_the_first_step_is_planned_from() -> None:
    lost = Belief.anywhere(ROOM.bounds_m)
    told = told_of(initial=lost)
    stub = Stub(lost)
    stack = navigator(told, stub)
    stub.belief = Belief(START, 1e-4 * np.eye(3))
    commands = [stack.step(Readings(0.1 * k, {})) for k in range(1, 15)]
    assert commands[0] == STOP
    assert commands[-1] != STOP
    assert len(told.journal.plans) == 1


def test_a_goal_in_the_wall_fails_before_the_start() -> None:
    told = told_of(start=START, goal=Goal(5.0, 1.0))
    stack = navigator(told, Stub(told.initial))
    status, reason = stack.status
    assert status is StackStatus.FAILED
    assert "goal" in reason
    assert [event.kind for event in told.journal.events] == ["failed"]
    assert stack.step(Readings(0.1, {})) == Twist(0.0, 0.0)


def test_who_gives_up_says_why_there_is_no_path() -> None:
    """It said that it had backed out, and not that something stands on its goal."""
    obstacle = "world.obstacles=[{kind: circle, centre_m: [1.65, 27.0], radius_m: 0.15}]"
    mission = load_mission("museum-1", (obstacle, "stack.navigator.max_replans=1"))
    reason = str(run_mission(mission, save=False).metrics["reason"])
    assert reason.startswith("stuck: gave up after 1 replans")
    assert "planning found goal blocked (the goal (2, 27) is" in reason


def test_a_goal_that_the_planners_clearance_does_not_leave_is_driven_to() -> None:
    """A map drawn from scans has its walls up to a cell too near."""
    low, _, _, _ = ROOM.bounds_m
    told = told_of(start=START, goal=Goal(low + 0.38, 4.0))
    stack = navigator(told, Stub(told.initial))
    assert stack.status[0] is StackStatus.RUNNING
    assert [event.kind for event in told.journal.events] == ["plan"]


@pytest.mark.parametrize("heading", [0.0, 1.5, 3.0, -2.0])
def test_a_plan_that_turns_on_the_spot_is_taken_up_by_turning(heading: float) -> None:
    """Between two walls there is no room for an arc."""
    walls = np.array([[0, 0, 6, 0], [6, 0, 6, 1.1], [6, 1.1, 0, 1.1], [0, 1.1, 0, 0]], dtype=float)
    corridor, start = SegmentMap.of(walls), Pose2(0.8, 0.55, heading)
    told = told_of(world=corridor, start=start, goal=Goal(5.0, 0.55))
    sim = alone(robot(sensors(), start=start, seed=0), walled(corridor))
    parts = Parts(
        localizer=Stub(told.initial),
        planner=PLANNERS.entry("astar").factory(PLANNERS.configure("astar", {"clearance_m": 0.4}, "planner")),
        smoother=None,
        local_planner=DubinsLocalPlanner(DubinsLocalConfig(), told.robot),
        controller=PiFollower(PiFollowerConfig(), told.robot),
        reactive=None,
        mapper=None,
        escape=None,
    )
    stack = told.navigator(GoalNavigator, GoalNavigatorConfig(), parts)
    command = STOP
    for _ in range(400):
        readings = sim.step(command)
        parts.localizer.belief = Belief(sim.truth, 1e-6 * np.eye(3))  # type: ignore[misc, union-attr]
        command = stack.step(readings)
        assert sim.body.collisions == 0
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert stack.status[0] is StackStatus.ARRIVED
    assert told.journal.counts["replans"] <= 1


def test_no_goal_is_refused() -> None:
    told = told_of(goal=None)
    with pytest.raises(InputError, match=r"world\.goal"):
        navigator(told, Stub(told.initial))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(-2.0, 12.0), st.floats(0.0, 6.0))
def test_the_nearest_point_of_a_window_of_a_chain(seed: int, low: float, width: float) -> None:
    rng = np.random.default_rng(seed)
    points = np.ascontiguousarray(rng.uniform(-1.0, 1.0, (30, 3)))
    along = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.5, 29))])
    low = min(low, float(along[-1]))
    x, y = rng.uniform(-1.0, 1.0, 2)
    first, last = np.searchsorted(along, [low, low + width])
    away = np.hypot(points[first : last + 1, 0] - x, points[first : last + 1, 1] - y)
    found = chain.nearest_along(points, along, x, y, low, low + width)
    assert found == along[first + int(np.argmin(away))]


def test_it_turns_on_the_spot_where_no_curve_leads_on_from_its_heading() -> None:
    """It faces the wall of a dead end too narrow for the planner's turns; a car stays refused there."""
    corridor = [[0.0, 0.0, 6.0, 0.0], [0.0, 1.1, 6.0, 1.1], [0.0, 0.0, 0.0, 1.1], [6.0, 0.0, 6.0, 1.1]]
    values = reach()
    values["world"] = {
        "map": {"map": "corridor", "walls_m": corridor, "landmarks": [{"id": 1, "x_m": 6.0, "y_m": 0.5}]},
        "start": {"x_m": 0.5, "y_m": 0.55, "theta_rad": 3.0},
        "goal": {"x_m": 5.0, "y_m": 0.55},
    }
    values["robot"]["footprint"]["radius_m"] = 0.2
    values["stack"]["planner"] = {"name": "rrt-star-dubins", "clearance_m": 0.3, "iterations": 1000}
    found = run_mission(mission_of(values), save=False)
    assert found.success
    assert found.metrics["collisions"] == 0
    assert cast(float, found.metrics["path_length_m"]) < 5.0
    values["robot"]["motion"] = {"name": "bicycle", "wheelbase_m": 0.25, "max_steering_rad": 0.5}
    stays = run_mission(mission_of(values), save=False)
    assert not stays.success
    assert "no path" in str(stays.metrics["reason"])


def parked(start: list[float], goal: list[float]) -> dict[str, Any]:
    """A robot of 0.51 x 0.43 m that drives through the car park by planned lines and a laser."""
    laser = {"name": "lidar", "beams": 360, "field_of_view_rad": 2.0 * math.pi, "max_range_m": 12.0}
    return {
        "mission": "parked",
        "world": {
            "map": "car-park",
            "start": dict(zip(["x_m", "y_m", "theta_rad"], start, strict=True)),
            "goal": dict(zip(["x_m", "y_m"], goal, strict=True)) | {"tolerance_m": 0.3},
        },
        "robot": {
            "footprint": {"points_m": [[0.255, 0.215], [-0.255, 0.215], [-0.255, -0.215], [0.255, -0.215]]},
            "motion": {"name": "differential-drive", "max_speed_m_s": 0.8},
            "sensors": {"odometry": {"name": "wheel-odometry"}, "lidar": laser},
        },
        "stack": {
            "initial": {"x_var_m2": 0.01, "y_var_m2": 0.01, "theta_var_rad2": 0.01},
            "navigator": {"name": "goal", "cruise_speed_m_s": 0.4},
            "planner": {"name": "theta-star", "clearance_m": 0.3},
            "smoother": "shortcut",
            "local_planner": {"name": "dubins", "speed_m_s": 0.4, "turning_radius_m": 0.3},
            "controller": "kanayama",
            "localizer": "particle-filter",
        },
        "run": {"time_limit_s": 200.0},
    }


@pytest.mark.parametrize(
    ("start", "seed"),
    [((2.88, 2.44, -2.11), 77005), ((3.92, 3.07, 1.44), 77025), ((2.4, 2.62, 2.97), 77030)],
)
def test_beside_a_corner_it_goes_on_slowly(start: tuple[float, float, float], seed: int) -> None:
    """Where the arc of a command leaves no room, the curve that begins with it may: it planned 30 times."""
    values = parked(list(start), [7.5, 6.9])
    found = run_mission(mission_of(values, seed=seed), save=False)
    assert found.success, found.metrics["reason"]
    assert found.metrics["collisions"] == 0


@pytest.mark.parametrize(
    ("start", "goal", "seed"),
    [((2.33, 3.87, 0.11), (7.5, 3.0), 88010), ((2.28, 2.8, 0.71), (7.5, 5.5), 88013)],
)
def test_a_car_backs_out_where_new_plans_do_not_help(
    start: tuple[float, float, float], goal: tuple[float, float], seed: int
) -> None:
    """They were made from where it stood, thirty in a row, and each was the last one again."""
    values = parked(list(start), list(goal))
    values["robot"]["footprint"] = {"points_m": [[0.5, 0.2], [-0.1, 0.2], [-0.1, -0.2], [0.5, -0.2]]}
    values["robot"]["motion"] = {
        "name": "bicycle",
        "wheelbase_m": 0.4,
        "max_speed_m_s": 0.8,
        "max_steering_rad": 0.6,
        "max_steering_rate_rad_s": 2.0,
    }
    values["stack"] |= {"planner": {"name": "theta-star", "clearance_m": 0.45}, "escape": "back-out"}
    values["stack"]["local_planner"] = {"name": "dubins", "speed_m_s": 0.4}
    backs = run_mission(mission_of(values, seed=seed), save=False)
    assert backs.success, backs.metrics["reason"]
    assert backs.metrics["collisions"] == 0


class Displaced:
    """A localizer that is off to the left by so much, and does not know it."""

    def __init__(self, sim: Alone, off_m: float) -> None:
        self._sim, self._off_m = sim, off_m

    @property
    def belief(self) -> Belief:
        truth = self._sim.truth
        return Belief(Pose2(truth.x_m, truth.y_m + self._off_m, truth.theta_rad), 1e-4 * np.eye(3))

    def step(self, readings: Readings) -> Belief:  # noqa: ARG002
        return self.belief


@pytest.mark.parametrize(
    "outline", [DISC, Footprint.polygon(np.array([[0.25, 0.2], [-0.2, 0.2], [0, -0.25]]))]
)
@pytest.mark.parametrize("off_m", [-0.35, 0.25, 0.35])
def test_who_is_not_where_it_believes_drives_into_nothing_that_its_laser_shows(
    off_m: float, outline: Footprint
) -> None:
    """By its map there was room beside the door's posts: it drove into them."""
    segments_m = ROOM.segments_m.copy()
    segments_m[4:] = [[5, 0, 5, 3.5], [5, 4.7, 5, 8]]
    told = told_of(SegmentMap.of(segments_m), start=START)
    sim = alone(robot(sensors(), start=START, footprint=outline, seed=0), told.chart)
    told = replace(told, robot=replace(told.robot, footprint=outline))
    stack = navigator(told, Displaced(sim, off_m), MapsNothing())
    command = STOP
    for _ in range(600):
        command = stack.step(sim.step(command))
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert sim.body.collisions == 0
    status, why = stack.status
    assert status is StackStatus.ARRIVED or "the stack has no escape" in why
    assert not outline.is_disc or math.hypot(sim.truth.x_m - 8.0, sim.truth.y_m + off_m - 6.0) < 0.3
