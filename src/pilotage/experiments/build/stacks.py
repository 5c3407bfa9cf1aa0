"""One robot's stack from a mission: what it is told, then its components."""

from __future__ import annotations

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.components import build_component, optional_component
from pilotage.experiments.oracles.certain import exactly
from pilotage.experiments.oracles.driver import WatchedLocalizer, WatchedStack
from pilotage.experiments.oracles.explorer import knowing_explorer
from pilotage.experiments.oracles.parts import TrueLocalizer, with_oracles
from pilotage.experiments.oracles.truth import Truth
from pilotage.maps.world_map import WorldMap
from pilotage.missions.places import GoalConfig
from pilotage.missions.stack import InitialConfig, StackConfig
from pilotage.replicas.wheel_pose import START_VAR_RAD2
from pilotage.stack.control.controller import CONTROLLERS
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS
from pilotage.stack.control.reactive import REACTIVES
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, Stack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.between_increments import BetweenIncrements, in_between
from pilotage.stack.localization.commanded_motion import CommandedStack
from pilotage.stack.localization.commanded_odometry import (
    CommandReckoningStack,
    with_commanded_odometry,
)
from pilotage.stack.localization.heading_filter import HEADING_FILTERS, HeadingEstimate, HeadingFilter
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.patrol.task import PatrolTask
from pilotage.stack.perception.joint_scan import JoiningStack, with_joint_lidar
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS
from pilotage.stack.planning.rounds import Rounds, best_rounds


def told(stack: StackConfig, chart: WorldMap) -> WorldMap:
    """The robot's own map at the start: the world's as it was drawn, its extent alone, or another file's.

    Raises
    ------
    InputError
        Where the file cannot be read.
    """
    if stack.map == "given":
        return chart
    if stack.map == "none":
        return chart.extent_only()
    return load_chart(stack.map)


def initial_belief(initial: InitialConfig, start: Pose2, streams: RandomStreams) -> Belief:
    """What the robot believes at first: the start with an error drawn from the initial covariance."""
    variances = np.array([initial.x_var_m2, initial.y_var_m2, initial.theta_var_rad2])
    error = np.sqrt(variances) * streams.stream("initial").standard_normal(3)
    pose = Pose2(
        start.x_m + float(error[0]),
        start.y_m + float(error[1]),
        wrap_to_pi(start.theta_rad + float(error[2])),
    )
    return Belief(pose, np.diag(variances))


def goal_of(goal: GoalConfig) -> Goal:
    """The goal that a mission file says."""
    theta = None if goal.theta_rad is None else wrap_to_pi(goal.theta_rad)
    return Goal(goal.x_m, goal.y_m, theta)


def rounds_of(
    config: StackConfig,
    robot: RobotKnowledge,
    chart: WorldMap,
    initial: Belief,
    goals: tuple[GoalConfig, ...],
    ends_at_last: bool,
) -> Rounds:
    """The order in which a robot visits goals that it may visit in any, by its own map and planner.

    Raises
    ------
    InputError
        Where a goal cannot be reached.
    """
    planner = optional_component(PLANNERS, config.planner, "planner")
    clearance_m = robot.radius_m if planner is None else max(planner.clearance_m, robot.radius_m)
    start = None if initial.status is BeliefStatus.LOST else initial.pose
    rng = robot.streams.stream("rounds")
    return best_rounds(chart, start, tuple(map(goal_of, goals)), ends_at_last, clearance_m, rng)


def build_stack(
    config: StackConfig,
    robot: RobotKnowledge,
    chart: WorldMap,
    task: TaskKnowledge,
    journal: Journal,
    truth: Truth | None = None,
    oracles: frozenset[str] = frozenset(),
    patrol: PatrolTask | None = None,
) -> Stack:
    """Build what runs on a robot; it plans while it is built.

    Parameters
    ----------
    chart
        The robot's own map.
    truth, oracles
        Which of its modules know the truth, and the truth; none as a rule.
    patrol
        Its share of a patrol.

    Raises
    ------
    InputError
        Where a component is unknown, or lacks what it needs.
    """
    if "explorer" in oracles and truth is not None:
        return knowing_explorer(robot, task, truth, journal)
    robot, join = with_joint_lidar(robot)
    robot, reckoned = with_commanded_odometry(robot, config.localizer, journal)
    localizer = _localizer(config, robot, chart, task, journal, truth, oracles)
    parts = Parts(
        localizer=localizer,
        planner=optional_component(PLANNERS, config.planner, "planner"),
        smoother=optional_component(SMOOTHERS, config.smoother, "smoother"),
        local_planner=optional_component(LOCAL_PLANNERS, config.local_planner, "local_planner", robot),
        controller=optional_component(CONTROLLERS, config.controller, "controller", robot),
        reactive=optional_component(REACTIVES, config.reactive, "reactive", robot),
        mapper=optional_component(MAPPERS, config.mapper, "mapper", robot, chart),
        escape=optional_component(ESCAPES, config.escape, "escape", robot),
        local_controller=optional_component(
            LOCAL_CONTROLLERS, config.local_controller, "local_controller", robot.streams.stream("controller")
        ),
        heading=_heading(config, task),
        patrol=patrol,
    )
    if truth is not None:
        parts = with_oracles(parts, oracles, truth, robot)
    stack = build_component(NAVIGATORS, config.navigator, "navigator", robot, chart, task, parts, journal)
    watched = parts.localizer
    stack = WatchedStack(stack, watched.watched) if isinstance(watched, WatchedLocalizer) else stack
    stack = CommandedStack(stack, localizer.commanded) if isinstance(localizer, BetweenIncrements) else stack
    stack = stack if reckoned is None else CommandReckoningStack(stack, reckoned)
    return stack if join is None else JoiningStack(stack, join)


def _heading(config: StackConfig, task: TaskKnowledge) -> HeadingFilter | None:
    """The mission's heading filter, for a navigator that drives by its wheels."""
    if config.heading is None:
        return None
    navigator = config.navigator.name
    if "heading" not in getattr(NAVIGATORS.entry(navigator).factory, "TAKES", ()):
        takers = [e.name for e in NAVIGATORS if "heading" in getattr(e.factory, "TAKES", ())]
        raise InputError(
            f"stack.heading: expected a navigator that takes a heading filter ({', '.join(takers)}), "
            f"found '{navigator}'"
        )
    told = task.initial
    at_start = HeadingEstimate(told.pose.theta_rad, START_VAR_RAD2 + float(told.cov[2, 2]))
    return build_component(HEADING_FILTERS, config.heading, "heading", at_start)


def _localizer(
    config: StackConfig,
    robot: RobotKnowledge,
    chart: WorldMap,
    task: TaskKnowledge,
    journal: Journal,
    truth: Truth | None,
    oracles: frozenset[str],
) -> Localizer | None:
    """The mission's localizer; a navigator may bring its own, or the truth may stand in for it."""
    if config.localizer is None:
        return TrueLocalizer(truth) if truth is not None and "localizer" in oracles else None
    built = build_component(LOCALIZERS, config.localizer, "localizer", robot, chart, task.initial, journal)
    return in_between(built, robot)


def first_belief(
    initial: InitialConfig, start: Pose2, chart: WorldMap, streams: RandomStreams, told_exactly: bool
) -> Belief:
    """What a robot believes before anything was measured."""
    belief = initial_belief(initial, start, streams)
    if told_exactly:
        return exactly(start)
    return belief if initial.known else Belief.anywhere(chart.bounds_m)
