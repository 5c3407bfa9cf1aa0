"""What all states of the goal navigator share: the parts, the map, the plan, and how far it has come."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Goal, Pose2, Twist
from pilotage.kernels.geometry import plane
from pilotage.sensors.readings import Readings
from pilotage.stack.control.controller import Controller
from pilotage.stack.control.give_way import GiveWay
from pilotage.stack.control.guard import ArcGuard
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.make_room import MakeRoom
from pilotage.stack.control.reactive import Reaction, ReactionKind
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.following import WaypointFollower
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.goal_config import GoalNavigatorConfig, Mode
from pilotage.stack.navigator.navigator import (
    TURN_RATE_RAD_S,
    Parts,
    arrival_within_m,
    localizer_of,
    turn_at_goal_rad,
    unexplained_of,
)
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.progress import PathProgress, StallWatch, patience_s
from pilotage.stack.navigator.state import Standing
from pilotage.stack.navigator.wandering import Wandering
from pilotage.stack.perception.moving_bodies import MovingBodies
from pilotage.stack.planning.local_planner import LocalPlanner
from pilotage.stack.planning.planner import PlanResult

HERE_TOLERANCE_M = 0.005
"""Slack between what a plan keeps and what is checked while driving it."""
ENDS_WITHIN = 0.75
"""Of the goal's tolerance: whose path ends farther away, as he believes, has not reached it for sure."""

MAPPED_TOLERANCE_M = 0.02
"""What the robot maps is drawn a little too large: where it stands there was room for it."""

SETTING_OUT_M = 0.1
"""A plan that begins with a turn on the spot is still at its beginning."""

SAME_PLACE_M = 0.15
"""A plan made so near by would be the same again."""

SOMEBODY_M = 2.0
"""With somebody who walks so near, what is close in front is a reason to give way, not to turn away."""

NO_REACTION = Reaction(ReactionKind.NONE, 0.0, math.inf, math.inf)


class Context(Standing):
    """The parts that the states drive with, the questions that they ask, and what the record wants to know.

    Attributes
    ----------
    bodies
        Who moves about, and what else no map that it was told explains.
    turn_rate_rad_s
        On the spot.
    t_s
        Of the last step.
    mode, reaction, to_go_m
        What is recorded of the last step.
    goals
        Places still to be visited, the current one first.
    tries, again
        New plans for which nobody who walks can be blamed; those in a row that were made where the last was.
    found_no_path
        Why the last new plan found none, in words.
    trail
        Poses since the last plan that did not start on them, for an escape to go back along.
    """

    def __init__(
        self,
        config: GoalNavigatorConfig,
        robot: RobotKnowledge,
        task: TaskKnowledge,
        parts: Parts,
        own_map: OwnMap,
        plan: GlobalPlan,
        local_planner: LocalPlanner,
        controller: Controller,
        journal: Journal,
    ) -> None:
        super().__init__(journal)
        self.config = config
        self.radius_m, self.is_disc = robot.radius_m, robot.footprint.is_disc
        self.goals: list[Goal] = list(task.goals)
        self._task, self._tolerance_m = task, task.goal_tolerance_m
        self._arrival_m = min(config.arrival_m, arrival_within_m(None, task.goal_tolerance_m))
        self._passes_m = ENDS_WITHIN * task.goal_tolerance_m
        self.turns_on_the_spot = robot.motion.least_turning_radius_m == 0.0
        # Without a mapper it minds nothing but its map: who shows it wrong scans shows it nobody.
        self.bodies = MovingBodies(
            config.moving_bodies,
            robot,
            own_map.told,
            minds=parts.mapper is not None,
            mates=task.mates,
            unexplained=unexplained_of(parts),
        )
        self._gives_way = GiveWay(config.give_way, robot, self.bodies)
        self.make_room = MakeRoom(config.make_room, robot, own_map.told.field, self.bodies)
        self._waits_s: float | None = None
        self._planned_s = 0.0
        self._waited_at, self._waited = (math.inf, math.inf), 0
        self.tries = self.again = 0
        self.found_no_path = ""
        self.turn_rate_rad_s = min(TURN_RATE_RAD_S, robot.motion.top_turn_rate_rad_s)
        self.reactive, self._mapper, self.escape = parts.reactive, parts.mapper, parts.escape
        self.own_map, self.plan = own_map, plan
        self.follower = WaypointFollower(local_planner, controller, robot.dt_s)
        self.guard, self._last_word = ArcGuard(config.guard, robot), LastWord(robot)
        self.wandering = Wandering(config.wander, robot, localizer_of(parts, "goal"), self._last_word)
        progress_m = config.stall_progress_m
        self.stall = StallWatch(
            progress_m, patience_s(config.stall_s, progress_m, robot.motion.top_speed_m_s)
        )
        self.t_s = 0.0
        self.mode, self.reaction, self.to_go_m = Mode.FOLLOW, NO_REACTION, math.nan
        self.trail: list[Pose2] = []

    @property
    def progress(self) -> PathProgress:
        """On the plan; asked only where there is one."""
        assert self.plan.progress is not None
        return self.plan.progress

    @property
    def clearance_m(self) -> float:
        """What the current plan keeps."""
        return self.journal.plans[-1].clearance_m

    # --- doing --------------------------------------------------------------------------------------

    def rest(self, readings: Readings) -> None:
        """Begin a step: nothing is commanded yet."""
        self.t_s = readings.t_s
        self._last_word.take_in(readings)
        self.follower.rest()
        self.reaction = NO_REACTION

    def map_what_is_new(self, readings: Readings, belief: Belief) -> None:
        """Put on the own map what the told one does not explain, and does not walk about."""
        readings = self.bodies.step(readings, belief)
        if self._mapper is not None:
            self._mapper.step(readings, belief)

    def react(self, readings: Readings, pose: Pose2) -> ReactionKind:
        """Let the reactive part say what is near; it does not know a wall from somebody who walks."""
        near = self.bodies.about and self.bodies.nearest_m(pose.x_m, pose.y_m) <= SOMEBODY_M
        if self.reactive is not None and not near:
            self.reaction = self.reactive.step(
                readings, pose, self.own_map.walls, self.plan.circles_m, self._goes_straight()
            )
        return self.reaction.kind

    def make_plan(self, pose: Pose2, clearances_m: list[float]) -> PlanResult:
        """Plan to the current goal on the own map; what it almost touched stands where it leaves a path."""
        found = self.own_map.found_circles_m
        result = self.plan.make(self.t_s, pose, self.goals[0], found, clearances_m)
        if result.path is None and self.own_map.forgets():
            return self.make_plan(pose, clearances_m)
        return result

    def plan_around_people(self, pose: Pose2) -> PlanResult:
        """The same with those who walk about where they are now."""
        circles = np.concatenate([self.own_map.found_circles_m, self.bodies.discs_m()])
        return self.plan.make(self.t_s, pose, self.goals[0], circles, self.clearances_m(pose))

    def waits(self, command: Twist, pose: Pose2) -> bool:
        """Whether to wait for somebody rather than to drive a command; standing still is no stall then."""
        if self._gives_way.allows(command, pose, self.own_map.found_circles_m):
            self._waits_s = None
            return False
        if self._waits_s is None:
            self._waits_s = self.t_s
            self.journal.count("waits")
        self.stall.restart(self.t_s)
        return True

    def has_room(self, command: Twist) -> bool:
        """Whether the lasers show room for a command, whatever the map says."""
        return self._last_word.allows(command)

    @property
    def rolls_on(self) -> bool:
        """Whether it takes longer than a step to stop."""
        return self._last_word.rolls_on

    def meets_walls(self, command: Twist, pose: Pose2) -> bool:
        """Whether a laser shows no room for a command; what it shows is mapped."""
        if self.has_room(command):
            return False
        self.own_map.show(pose.placed(self._last_word.shown_m))
        return True

    def leaving(self, command: Twist) -> Twist:
        """What leaves for a step's command: a stop brakes along the arc that the robot is on."""
        return self._last_word.leaving(command)

    @property
    def among_people(self) -> bool:
        """Whether somebody walked about a moment ago: what blocks the path may be gone soon."""
        return self.bodies.about

    @property
    def may_back(self) -> bool:
        """Whether nobody can be behind it whom its laser does not see."""
        return not self.bodies.may_be_at(math.pi)

    def meets_something_new(self, pose: Pose2) -> bool:
        """Whether something came into sight just now, near enough, that may be the first person it meets."""
        return self.bodies.is_new(pose.x_m, pose.y_m, SOMEBODY_M)

    def helps_to_make_room(self, pose: Pose2) -> bool:
        """Whether a place aside is any better than to stand here."""
        return self.make_room.helps(pose, self.own_map.found_circles_m)

    def may_turn(self, pose: Pose2) -> bool:
        """Whether it turns on the spot, here without touching anything."""
        return self.turns_on_the_spot and self.make_room.may_turn(pose, self.own_map.found_circles_m)

    def out_of_patience(self, pose: Pose2) -> int:
        """How often in a row it has now waited for long in one place; 0 while it still has patience."""
        if self._waits_s is None or self.t_s - self._waits_s < self.config.give_way.patience_s:
            return 0
        self._waits_s = self.t_s
        here = pose.x_m, pose.y_m
        if math.dist(here, self._waited_at) > self.config.stall_progress_m:
            self._waited_at, self._waited = here, 0
        self._waited += 1
        return self._waited

    def take_plan(self, kind: str, why: str = "") -> None:
        """Drive by the plan just made from now on."""
        plan = self.journal.plans[-1]
        self.stall.restart(self.t_s)
        self._planned_s = self.t_s
        self.to_go_m = plan.length_m
        because = f"{why}: " if why else ""
        self.say(
            kind, f"{because}{plan.length_m:.2f} m to go, planned in {plan.planning_time_s * 1e3:.0f} ms"
        )

    def replan_locally(self, pose: Pose2) -> bool:
        """Plan to the next waypoint that can be reached; False where there is none."""
        route = self.progress.route_ahead(self.config.waypoint_ahead_m)
        return self.follower.replan(pose, route, self.own_map.barriers, self.own_map.circles_m)

    def say(self, kind: str, text: str) -> None:
        """Tell that something happened."""
        self.journal.say(self.t_s, kind, text)

    # --- asking -------------------------------------------------------------------------------------

    def stalled(self) -> bool:
        """Whether the distance to go has not shrunk for too long."""
        return self.stall.stalled(self.to_go_m, self.t_s)

    def clearances_m(self, pose: Pose2) -> list[float]:
        """Clearances to try in turn: the planner's own, the fallbacks, and what there is where it stands."""
        asked = self.first_clearances_m()
        here = self.own_map.distance_m(pose)
        squeezed = max(here - HERE_TOLERANCE_M, self.radius_m - MAPPED_TOLERANCE_M)
        if self.among_people:
            # Who stands beside it is no reason to squeeze past walls.
            squeezed = max(self._to_walls_m(pose) - HERE_TOLERANCE_M, self.radius_m + HERE_TOLERANCE_M)
        return asked + ([squeezed] if squeezed < min(asked) else [])

    def first_clearances_m(self) -> list[float]:
        """Clearances to try in turn wherever it stands: the planner's own, and the fallbacks below it."""
        own = self.plan.clearance_m
        fallbacks = (self.radius_m + margin for margin in self.config.fallback_margins_m)
        return [own, *(clearance for clearance in fallbacks if clearance <= own)]

    def _to_walls_m(self, pose: Pose2) -> float:
        """Distance to what the robot was told of."""
        own = self.own_map
        return plane.distance_to_nearest(pose.x_m, pose.y_m, own.barriers.segments_m, own.known_circles_m)

    def path_is_blocked(self) -> bool:
        """Whether the local path ahead comes too near to what the robot mapped."""
        config = self.config
        if self._mapper is None or config.watch_ahead_m == 0.0:
            return False
        ahead = self.follower.clearance_ahead_m(config.watch_ahead_m, self._mapper.circles_m)
        return ahead < min(self.radius_m + config.watch_margin_m, self.clearance_m - HERE_TOLERANCE_M)

    def plan_is_blocked(self) -> bool:
        """Whether something new stands on the plan ahead: the sooner it turns away the shorter its path.

        Not where people walk about: what blocks the path may be gone by then.
        """
        period_s = self.config.watch_plan_s
        if period_s is None or self.t_s - self._planned_s < period_s or self.among_people:
            return False
        return self.plan.is_blocked(self.own_map.found_circles_m, self.radius_m + self.config.watch_margin_m)

    def planned_here(self, pose: Pose2) -> bool:
        """Whether the plan was made about here: another one would be the same."""
        path = self.plan.path
        if path is None:
            return False
        x, y, _ = path.states[0]
        return math.hypot(x - pose.x_m, y - pose.y_m) < SAME_PLACE_M

    def near_goal(self, pose: Pose2) -> bool:
        """Whether this is the end: near the goal, and not merely passing by it with path left to go."""
        goal = self.goals[0]
        away = math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m)
        if self.to_go_m > away + self._tolerance_m:
            return False
        return away <= self._arrival_m or (away <= self._passes_m and self.to_go_m < 0.02)

    def turn_at_goal_rad(self, pose: Pose2) -> float:
        """How far to turn at the last goal; 0 where its heading is met, or the robot cannot turn so."""
        return turn_at_goal_rad(self._task, pose) if self.turns_on_the_spot else 0.0

    def turn_to_plan_rad(self, pose: Pose2) -> float:
        """How far to turn to head as the plan does here; 0 where the plan, or the robot, does not turn so."""
        path = self.plan.path
        if path is None or not self.turns_on_the_spot:
            return 0.0
        first = self.plan.turns_first and self.progress.at_m < SETTING_OUT_M
        if path.turning_radius_m > 0.0 and not first:
            return 0.0
        return wrap_to_pi(self.progress.heading_rad - pose.theta_rad)

    def _goes_straight(self) -> bool:
        turn = self.progress.turn_ahead_rad(self.config.straight_ahead_m)
        return turn < self.config.straight_below_rad
