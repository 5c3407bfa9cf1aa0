"""One example a component: parameters that work, and a small task that it must do."""

from __future__ import annotations

import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from contract.exploring_examples import explores_the_floor
from contract.fault_examples import fault_befalls
from contract.local_examples import LOCAL_EXAMPLES, navigator_drives_by_the_laser
from contract.numbers_of_sensors import tells_its_numbers
from contract.patrol_examples import STRATEGY_NUMBERS, navigator_patrols, strategy_patrols
from contract.people_examples import people_walk
from contract.rover_examples import (
    chains_legs,
    dead_reckoning_follows_the_bend,
    drives_over_cells,
    gps_filter_follows_the_bend,
    moves_to_a_pose,
    rover_filter_follows,
)
from contract.sheet_examples import explorer_explores, sheet_sensor_reads
from contract.task_examples import motion_moves, task_runs
from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2, Twist
from pilotage.kernels.geometry import plane
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.near_walls import NearWalls
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.sensors.readings import Readings, UltrasonicReading
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.control.pi_follower import PiFollower, PiFollowerConfig
from pilotage.stack.interface import StackStatus
from pilotage.stack.localization.ekf_landmarks import EkfLandmarkLocalizer
from pilotage.stack.localization.heading_filter import HeadingEstimate
from pilotage.stack.localization.landmark_filter import LandmarkFilterConfig
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.dubins_local import DubinsLocalConfig, DubinsLocalPlanner
from pilotage.stack.planning.hybrid_astar import HybridAstarConfig, HybridAstarPlanner
from pilotage.stack.planning.local_planner import RouteAhead
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, Planner, PlanRequest
from pilotage.stack.planning.rrt_star_dubins import RrtStarDubinsConfig, RrtStarDubinsPlanner
from support import worlds
from support.robots import ROOM, sensors, told_of

SLAM_NUMBERS = frozenset(
    {"least_score", "least_agreement", "least_overlap", "most_ambiguity", "gate_probability"}
)
START, GOAL = Pose2(2.0, 2.0, 0.0), Goal(8.0, 6.0)
NO_CIRCLES = ROOM.circles_m
WALLS = NearWalls(ROOM.segments_m)


@dataclass(frozen=True)
class Example:
    """Parameters, the task, and the names of floats that are pure numbers."""

    works: Callable[[Any, Any], None]
    parameters: dict[str, Any] = field(default_factory=dict)
    pure_numbers: frozenset[str] = frozenset()


def simulator(configs: dict[str, Any] | None = None, motion: MotionConfig | None = None) -> worlds.Alone:
    """The small robot in the small room."""
    return worlds.alone(worlds.robot(configs or sensors(), motion, start=START))


def sensor_reads(_: Any, config: Any) -> None:
    """The same world gives the same reading twice."""
    assert SIMULATED_SENSORS.of(config, "robot.sensors.it") is not None
    readings = [simulator({"it": config}).step(Twist(0.1, 0.0)).by_sensor["it"] for _ in range(2)]
    assert repr(readings[0]) == repr(readings[1])
    tells_its_numbers(config, readings[:1], 0.1)


def sensor_reads_in_any_world(_: Any, config: Any) -> None:
    """The same world and seed give the same readings twice."""
    series = [
        [sim.step([Twist(0.1, 0.0)])[0].by_sensor.get("it") for _ in range(20)]
        for sim in (worlds.simulator(worlds.robot({"it": config})) for _ in range(2))
    ]
    assert repr(series[0]) == repr(series[1])
    assert any(reading is not None for reading in series[0])
    tells_its_numbers(config, series[0], 0.1)


def localizer_follows(factory: Any, config: Any) -> None:
    """Driven through the room, by a base that drives sideways too, it stays within 5 sigma of the truth and
    keeps its covariance positive."""
    for motion, lateral_m_s in ((None, 0.0), (OmnidirectionalConfig(), 0.25)):
        localizer_follows_a_base(factory, config, motion, lateral_m_s)


def localizer_follows_a_base(
    factory: Any, config: Any, motion: MotionConfig | None, lateral_m_s: float
) -> None:
    """A bend to the left and one to the right, at a speed to the left."""
    sim = simulator(motion=motion)
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(factory, config)
    for step in range(60):
        belief = localizer.step(sim.step(Twist(0.3, 0.4 if step < 30 else -0.4, lateral_m_s)))
        assert (belief.cov == belief.cov.T).all()
        assert np.linalg.eigvalsh(belief.cov).min() > 0.0
        truth = sim.truth
        error = np.hypot(truth.x_m - belief.pose.x_m, truth.y_m - belief.pose.y_m)
        assert error < 5.0 * np.sqrt(np.linalg.eigvalsh(belief.cov[:2, :2])[-1])
    handed_out = belief.cov.copy()
    localizer.step(sim.step(Twist(0.3, 0.0, lateral_m_s)))
    assert (belief.cov == handed_out).all(), "a belief that was handed out must not change"


def dead_reckoning_follows(factory: Any, config: Any) -> None:
    """Through the room, and along a bend, with either covariance."""
    localizer_follows(factory, config)
    for covariance in ("first-order", "second-order"):
        dead_reckoning_follows_the_bend(factory, config.model_copy(update={"covariance": covariance}))


def localizer_runs(factory: Any, config: Any) -> None:
    """A filter kept for comparison: it may be lost, but its numbers stay numbers."""
    sim = simulator()
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(factory, config)
    for step in range(60):
        belief = localizer.step(sim.step(Twist(0.3, 0.4 if step < 30 else -0.4)))
        assert np.isfinite(belief.cov).all()
        assert np.linalg.eigvalsh(belief.cov).min() > 0.0


def heading_filter_follows(factory: Any, config: Any) -> None:
    """A turn, a rest and a turn back: within 5 sigma, a variance that stays positive, one line on misuse."""
    rng = np.random.default_rng(3)
    heading_filter = factory(config, HeadingEstimate(0.5, 1e-4))
    heading, dt = 0.5, 0.05
    for step in range(400):
        rate = (0.8, 0.0, -0.8, 0.0)[step // 100]
        resting = rate == 0.0
        heading = wrap_to_pi(heading + rate * dt)
        encoder = rate * dt + (0.0 if resting else 0.004 * float(rng.normal()))
        gyro = rate + 0.015 + 0.001 * float(rng.normal())
        compass = wrap_to_pi(heading + 0.05 * float(rng.normal())) if step % 4 == 0 else None
        estimate = heading_filter.step(encoder, gyro, dt, resting, compass)
        assert estimate == heading_filter.estimate
        assert estimate.variance_rad2 > 0.0
        assert abs(wrap_to_pi(estimate.heading_rad - heading)) < 5.0 * np.sqrt(estimate.variance_rad2)
    heading_filter.step(None, 0.1, dt, False)
    heading_filter.step(0.1, None, dt, False)
    for bad in ((None, None, dt), (0.1, 0.1, 0.0), (np.nan, 0.1, dt), (0.1, np.inf, dt), (0.1, 0.1, np.nan)):
        with pytest.raises(InputError, match="expected"):
            heading_filter.step(*bad, False)


def request(seed: int = 0, goal: Goal = GOAL) -> PlanRequest:
    """A planning query in the room."""
    return PlanRequest(START, goal, DistanceField.from_map(ROOM), np.random.default_rng(seed), 0.4)


def assert_valid(path: Path, goal: Goal, clearance_m: float = 0.4) -> None:
    """Starts at the start, ends at the goal, keeps its clearance, has its waypoints on it."""
    assert np.allclose(path.states[0, :2], [START.x_m, START.y_m], atol=1e-6)
    assert np.allclose(path.states[-1, :2], [goal.x_m, goal.y_m], atol=1e-6)
    assert plane.least_distance(np.ascontiguousarray(path.states[:, :2]), ROOM.segments_m, NO_CIRCLES) >= (
        clearance_m - 1e-6
    )
    assert np.hypot(*np.diff(path.states[:, :2], axis=0).T).max() <= 0.05 + 1e-9
    for x, y, _ in path.waypoints:
        assert np.hypot(path.states[:, 0] - x, path.states[:, 1] - y).min() < 0.05


def planner_plans(factory: Any, config: Any, kept_m: float = 0.4) -> None:
    """A valid path, the same for the same seed; blocked ends are a status, not an exception."""
    results = [factory(config).plan(request()) for _ in range(2)]
    assert results[0].status is PlanStatus.FOUND
    assert results[0].path is not None
    assert_valid(results[0].path, GOAL, kept_m)
    assert (results[0].path.states == results[1].path.states).all()
    assert factory(config).clearance_m > 0.0
    in_the_wall = factory(config).plan(
        PlanRequest(Pose2(5.0, 1.0, 0.0), GOAL, DistanceField.from_map(ROOM), np.random.default_rng(0), 0.4)
    )
    assert in_the_wall.path is None
    assert in_the_wall.reason


def hybrid_astar_plans(factory: Any, config: Any) -> None:
    """As the others; it looks at its arcs every 4 cm, so a wall may come 2 cm nearer in between."""
    planner_plans(factory, config, kept_m=0.38)


def smoother_smooths(factory: Any, config: Any) -> None:
    """Never longer, never invalid, the same ends."""
    result = RrtStarDubinsPlanner(RrtStarDubinsConfig(stop="first")).plan(request())
    assert result.path is not None
    before = result.path.states.copy()
    smooth = factory(config).smooth(result.path, request(), 0.4)
    assert smooth.length_m <= result.path.length_m + 1e-9
    assert_valid(smooth, GOAL)
    assert (result.path.states == before).all()


def local_planner_reaches_the_waypoint(factory: Any, config: Any) -> None:
    """Points at a constant step; a wall in between is not crossed."""
    planner = factory(config, told_of().robot)
    way = np.column_stack([np.linspace(2.0, 3.5, 31), np.full(31, 2.0), np.zeros(31)])
    route = RouteAhead(way[[-1]], np.array([1.5]), way, 0.4)
    local = planner.plan(START, route, WALLS, NO_CIRCLES)
    assert local is not None
    steps = np.hypot(*np.diff(local.states[:, :2], axis=0).T)
    assert np.allclose(steps[:-1], local.speed_m_s * 0.1, atol=1e-3)
    beyond = np.array([[6.0, 2.0, 0.0]])
    through_the_wall = RouteAhead(beyond, np.array([4.0]), way[:1], 0.4)
    assert planner.plan(START, through_the_wall, WALLS, NO_CIRCLES) is None


def controller_turns_to_the_reference(factory: Any, config: Any) -> None:
    """Left for a reference to the left, right for one to the right; a reset forgets."""
    controller = factory(config, told_of().robot)
    turns = []
    for side in (0.3, -0.3):
        controller.reset()
        for _ in range(5):
            control = controller.step(START, Pose2(2.5, 2.0 + side, 0.0), Twist(0.5, 0.0))
        turns.append(control.twist.w_rad_s)
    assert turns[0] > 0.0 > turns[1]
    assert abs(turns[0] + turns[1]) < 1e-9


def reactive_reacts(factory: Any, config: Any) -> None:
    """Nothing near, no reaction; something in front, it turns."""
    reactive = factory(config, told_of().robot)
    clear = {name: UltrasonicReading(3.0, True) for name in ("front", "left", "right")}
    near = {**clear, "front": UltrasonicReading(0.5, False)}
    empty = NearWalls(np.zeros((0, 4)))
    assert reactive.step(Readings(0.1, clear), START, empty, NO_CIRCLES, True).w_rad_s == 0.0
    assert reactive.step(Readings(0.2, near), START, empty, NO_CIRCLES, True).w_rad_s != 0.0


def mapper_maps(factory: Any, config: Any) -> None:
    """An unexpected disc comes to the map where it is; known walls do not."""
    surprised = World.of(worlds.ROOM_MAP, obstacle_circles_m=np.array([[3.5, 2.0, 0.3]]))
    sim = worlds.Alone(Simulator(surprised, [worlds.robot(sensors(), start=START)], 0.1))
    told = told_of(variances=(1e-6, 1e-6, 1e-6))
    mapper = factory(config, told.robot, told.chart)
    for _ in range(20):
        mapper.step(sim.step(Twist(0.0, 0.0)), told.initial)
    assert mapper.circles_m.shape[0] > 0
    away = np.hypot(mapper.circles_m[:, 0] - 3.5, mapper.circles_m[:, 1] - 2.0)
    assert (np.abs(away - 0.3) < 0.15).all()


def escape_ends(factory: Any, config: Any) -> None:
    """It moves backwards along its trail, and it ends."""
    escape = factory(config, told_of().robot)
    escape.begin([Pose2(0.5 + 0.05 * i, 2.0, 0.0) for i in range(80)])
    pose = Pose2(4.45, 2.0, 0.0)
    for _ in range(1000):
        command = escape.step(pose)
        if command is None:
            break
        pose = Pose2(pose.x_m + 0.1 * command.v_m_s, 2.0, 0.0)
    assert command is None
    assert pose.x_m < 4.0


def navigator_maneuvers(factory: Any, config: Any) -> None:
    """With the planner that it is made for."""
    navigator_arrives(factory, config, HybridAstarPlanner(HybridAstarConfig(clearance_m=0.4)))


def navigator_arrives(factory: Any, config: Any, planner: Planner | None = None) -> None:
    """Put together from the plainest parts, it drives to its goal."""
    told = told_of(start=START, goal=GOAL, variances=(1e-4, 1e-4, 1e-4))
    parts = Parts(
        localizer=told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig()),
        planner=planner or RrtStarDubinsPlanner(RrtStarDubinsConfig(clearance_m=0.4, iterations=2000)),
        smoother=None,
        local_planner=DubinsLocalPlanner(DubinsLocalConfig(), told.robot),
        controller=None if planner else PiFollower(PiFollowerConfig(), told.robot),
        reactive=None,
        mapper=None,
        escape=None,
    )
    stack = told.navigator(factory, config, parts)
    sim, command = simulator(), Twist(0.0, 0.0)
    for _ in range(600):
        command = stack.step(sim.step(command))
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert stack.status[0] is StackStatus.ARRIVED
    truth = sim.truth
    assert np.hypot(truth.x_m - GOAL.x_m, truth.y_m - GOAL.y_m) < 0.3
    assert {event.kind for event in told.journal.events} >= {"plan", "arrived"}


def navigator_keeps_its_command(factory: Any, config: Any) -> None:
    """The same command for the time given, then a stop."""
    told = told_of(start=START, variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig())
    stack = told.navigator(factory, config, Parts(localizer, None, None, None, None, None, None, None))
    sim, command = simulator(), Twist(0.0, 0.0)
    commands = []
    while stack.status[0] is StackStatus.RUNNING:
        command = stack.step(sim.step(command))
        commands.append(command)
    assert commands == [Twist(0.2, 0.1)] * 20 + [Twist(0.0, 0.0)]
    assert stack.status[0] is StackStatus.ARRIVED
    assert [event.kind for event in told.journal.events] == ["arrived"]


ROUTE = {"points_m": [[2.0, 2.0], [3.0, 4.0], [7.0, 4.0], [8.0, 6.0]], "turning_radius_m": 0.4}

FILTER_NUMBERS = frozenset({"gate", "measurement_var_scale", "odometry_var_scale"})


def navigator_plans(factory: Any, config: Any) -> None:
    """A plan from start to goal, and nobody moves."""
    told = told_of(start=START, goal=GOAL, variances=(1e-12, 1e-12, 1e-12))
    planner = RrtStarDubinsPlanner(RrtStarDubinsConfig(stop="first"))
    localizer = told.localizer(EkfLandmarkLocalizer, LandmarkFilterConfig())
    parts = Parts(localizer, planner, None, None, None, None, None, None)
    navigator = told.navigator(factory, config, parts)
    assert navigator.status[0] is StackStatus.ARRIVED
    assert len(told.journal.plans) == 1
    assert navigator.step(Readings(0.1)) == Twist(0.0, 0.0)


SCALAR_FILTER_NUMBERS = frozenset({"process_var", "measurement_var", "initial_var"})


def fault(parameters: dict[str, Any]) -> Example:
    """A fault of some sensor."""
    return Example(fault_befalls, {"sensor": "lidar", **parameters}, frozenset({"share"}))


EXAMPLES: dict[tuple[str, str], Example] = {
    ("sensor", "wheel-odometry"): Example(
        sensor_reads, pure_numbers=frozenset({"distance_scale", "angle_scale"})
    ),
    ("sensor", "lidar"): Example(sensor_reads, {"beams": 181}),
    ("sensor", "beacons"): Example(sensor_reads),
    ("sensor", "ultrasonic"): Example(sensor_reads, {"range_var_m2": 1e-4}),
    ("localizer", "ekf-landmarks"): Example(localizer_follows, {"gate": 0.999}, FILTER_NUMBERS),
    ("localizer", "iekf-landmarks"): Example(localizer_follows, {"gate": 0.999}, FILTER_NUMBERS),
    ("localizer", "ukf-landmarks"): Example(localizer_follows, {"gate": 0.999}, FILTER_NUMBERS),
    ("localizer", "ekf-augmented"): Example(
        localizer_follows, {"systematic": {"distance_scale_var": 1e-3}}, FILTER_NUMBERS
    ),
    ("localizer", "ekf-gauss-markov"): Example(
        localizer_follows,
        {"gate": 0.999},
        frozenset(
            {
                "gate",
                "range_var_fraction",
                "range_scale",
                "depth_power",
                "recovery_factor",
                "doubt_factor",
                "doubt_limit",
            }
        ),
    ),
    ("localizer", "dead-reckoning"): Example(
        dead_reckoning_follows, pure_numbers=frozenset({"odometry_var_scale"})
    ),
    ("localizer", "ekf-gps"): Example(
        gps_filter_follows_the_bend, {"gate": 0.99}, frozenset({"gate", "odometry_var_scale"})
    ),
    ("localizer", "ekf-walls"): Example(
        localizer_follows,
        {"gate": 0.99, "matching": {"overlap": 0.7}},
        frozenset({"gate", "measurement_var_scale", "odometry_var_scale"}),
    ),
    ("localizer", "particle-filter"): Example(
        localizer_follows,
        {"beams": 90},
        FILTER_NUMBERS | {"kld_error", "kld_probability", "spread"},
    ),
    ("localizer", "laser"): Example(localizer_follows, {"walls": {"gate": 0.99}, "cells": {"beams": 90}}),
    ("heading", "encoder-gyro"): Example(heading_filter_follows, {"process_var": 0.1}, SCALAR_FILTER_NUMBERS),
    ("heading", "encoder-magnetometer"): Example(
        heading_filter_follows, {"process_var": 0.1}, SCALAR_FILTER_NUMBERS
    ),
    ("heading", "gyro-bias"): Example(
        heading_filter_follows, {"gate": 0.9999}, pure_numbers=frozenset({"gate"})
    ),
    ("localizer", "ekf-walls-report"): Example(
        localizer_runs, {"threshold_chi2": 2.0, "distance_var_m2": 5.0}, frozenset({"threshold_chi2"})
    ),
    ("planner", "rrt-star-reeds-shepp"): Example(
        planner_plans,
        {"iterations": 2000, "further_iterations": 200},
        frozenset({"reverse_cost", "goal_bias", "guide_bias", "rewire_factor"}),
    ),
    ("planner", "rrt-star-dubins"): Example(
        planner_plans, {"iterations": 2000}, frozenset({"goal_bias", "guide_bias", "rewire_factor"})
    ),
    ("planner", "route"): Example(planner_plans, ROUTE),
    ("planner", "boustrophedon"): Example(planner_plans, {"width_m": 1.0}, frozenset({"enough"})),
    ("planner", "astar"): Example(planner_plans),
    ("planner", "dijkstra"): Example(planner_plans),
    ("planner", "theta-star"): Example(planner_plans),
    ("planner", "hybrid-astar"): Example(
        hybrid_astar_plans, {}, frozenset({"reverse_cost", "turn_cost", "greed", "greedy_share"})
    ),
    ("smoother", "shortcut"): Example(smoother_smooths),
    ("smoother", "none"): Example(smoother_smooths),
    ("local_planner", "dubins"): Example(local_planner_reaches_the_waypoint),
    ("controller", "pi-follower"): Example(controller_turns_to_the_reference),
    ("reactive", "ultrasonic"): Example(reactive_reacts),
    ("mapper", "obstacle-layer"): Example(mapper_maps, pure_numbers=frozenset({"sigmas"})),
    ("escape", "back-out"): Example(escape_ends),
    ("navigator", "goal"): Example(navigator_arrives),
    ("navigator", "maneuver"): Example(navigator_maneuvers, {}, frozenset({"acceleration_share"})),
    ("localizer", "slam"): Example(localizer_follows, {"trajectory": "scanner"}, SLAM_NUMBERS),
    ("navigator", "floor-frontier"): Example(explores_the_floor, pure_numbers=frozenset({"length_gain"})),
    ("navigator", "local"): Example(navigator_drives_by_the_laser, {"arrival_m": 0.25}),
    **{
        ("local_controller", name): Example(works, {}, pure) for name, (works, pure) in LOCAL_EXAMPLES.items()
    },
    ("navigator", "open-loop"): Example(
        navigator_keeps_its_command, {"speed_m_s": 0.2, "turn_rate_rad_s": 0.1, "duration_s": 2.0}
    ),
    ("navigator", "plan-only"): Example(navigator_plans),
    ("sensor", "wheel-encoders"): Example(sheet_sensor_reads),
    ("sensor", "gyroscope"): Example(sheet_sensor_reads, pure_numbers=frozenset({"scale_error"})),
    ("sensor", "magnetometer"): Example(sheet_sensor_reads),
    ("sensor", "infrared"): Example(sheet_sensor_reads, pure_numbers=frozenset({"range_std_fraction"})),
    ("sensor", "line-sensor"): Example(sheet_sensor_reads),
    ("sensor", "imu"): Example(sensor_reads_in_any_world),
    ("sensor", "compass"): Example(sensor_reads_in_any_world),
    ("sensor", "gps"): Example(sensor_reads_in_any_world),
    ("sensor", "bumper"): Example(sensor_reads_in_any_world),
    ("sensor", "radio"): Example(sensor_reads_in_any_world, pure_numbers=frozenset({"loss"})),
    ("localizer", "invariant-ekf-landmarks"): Example(
        rover_filter_follows,
        {"gate": 0.999},
        frozenset({"gate", "measurement_var_scale", "odometry_var_scale"}),
    ),
    ("navigator", "pose"): Example(moves_to_a_pose, {"arrival_m": 0.01}),
    ("navigator", "curve"): Example(drives_over_cells, {"speed_m_s": 0.5}),
    ("navigator", "chain"): Example(
        chains_legs,
        {
            "legs": [
                {
                    "name": "pose",
                    "rho_gain_per_s": 0.02,
                    "alpha_gain_per_s": 0.05,
                    "beta_gain_per_s": -0.02,
                    "arrival_m": 0.3,
                },
                {"name": "curve", "speed_m_s": 0.5},
            ]
        },
    ),
    ("controller", "kanayama"): Example(controller_turns_to_the_reference),
    ("navigator", "random-walk"): Example(explorer_explores),
    ("navigator", "frontier"): Example(
        explorer_explores, pure_numbers=frozenset({"depth_std", "speed_share"})
    ),
    ("navigator", "surround-check"): Example(
        explorer_explores, {"margin_cells": 1}, pure_numbers=frozenset({"far_cells"})
    ),
    ("task", "patrol"): Example(task_runs("patrol"), {"duration_s": 20.0}),
    ("task", "sweep-floor"): Example(task_runs("sweep-floor"), {}, frozenset({"least"})),
    ("navigator", "patrol"): Example(navigator_patrols, {"yield_s": 6.0}),
    **{("strategy", name): Example(strategy_patrols, {}, pure) for name, pure in STRATEGY_NUMBERS.items()},
    ("fault", "drop"): fault({}),
    ("fault", "gap"): fault({"length_s": 3.0}),
    ("fault", "delay"): fault({}),
    ("fault", "repeat"): fault({"share": 0.3}),
    ("fault", "shuffle"): fault({}),
    ("fault", "swap-identities"): fault({"share": 0.3}),
    ("fault", "outliers"): fault({}),
    ("fault", "bias-step"): fault({"by_m": 0.2, "by_rad": 0.1}),
    ("people", "track"): Example(
        people_walk, {"file": str(pathlib.Path(__file__).parent.parent / "support" / "walkers.txt")}
    ),
    ("people", "social-force"): Example(people_walk, {"count": 6}),
    ("people", "intruder"): Example(people_walk, {"enters_from_s": 0.0, "enters_until_s": 0.5}),
    ("motion", "differential-drive"): Example(motion_moves),
    ("motion", "wheel-drive"): Example(motion_moves, {"max_wheel_speed_rad_s": 20.0}),
    ("motion", "bicycle"): Example(motion_moves, {"wheelbase_m": 0.5}),
    ("motion", "omnidirectional"): Example(motion_moves),
    ("task", "reach"): Example(task_runs("reach")),
    ("task", "plan"): Example(task_runs("plan")),
    ("task", "drive"): Example(task_runs("drive")),
    ("task", "follow"): Example(task_runs("follow"), {"points_m": ((4.0, 4.0), (7.0, 4.0))}),
    ("task", "localize"): Example(task_runs("localize")),
    ("task", "explore"): Example(task_runs("explore"), {"blocked_s": 2.0}, frozenset({"least_mapped"})),
}
