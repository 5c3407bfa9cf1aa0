"""The goal navigator: the night watch's loop of localizing, planning, following and reacting."""

from __future__ import annotations

import math

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.control.guard import ArcGuard
from pilotage.stack.control.reactive import Reaction, ReactionKind
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.following import WaypointFollower
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.goal_config import GoalNavigatorConfig, Mode
from pilotage.stack.navigator.lost import LostDriving
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.progress import StallWatch
from pilotage.stack.planning.planner import PlanStatus

HERE_TOLERANCE_M = 0.005
"""Slack between what a plan keeps and what is checked while driving it."""

MAPPED_TOLERANCE_M = 0.02
"""What the robot maps is drawn a little too large: where it stands there was room for it."""

PLAN_AGAIN_S = 1.0
"""A robot that found itself where no plan begins drives on for this long before the next."""

COLUMNS = {
    "ref_x_m": "m",
    "ref_y_m": "m",
    "ref_theta_rad": "rad",
    "w_feedforward_rad_s": "rad/s",
    "w_proportional_rad_s": "rad/s",
    "w_integral_rad_s": "rad/s",
    "w_reactive_rad_s": "rad/s",
    "path_error_m": "m",
    "mode": "1",
    "distance_to_go_m": "m",
}
"""Reference, parts of the command, mode and progress."""

NO_REACTION = Reaction(ReactionKind.NONE, 0.0, math.inf, math.inf)


@NAVIGATORS.add("goal", GoalNavigatorConfig)
class GoalNavigator:
    """Drives to a goal.

    Plans globally before the start; then at every step localizes, maps what is unexpected, follows the
    local plan, and reacts. After an avoidance it replans locally; globally, with the obstacle on the
    robot's own map, where no next waypoint can be reached, the robot is trapped, or it gets no further.
    While its localizer is lost it wanders about by its scanner, maps nothing, and plans once it is found.
    """

    def __init__(
        self,
        config: GoalNavigatorConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        if task.goal is None:
            raise InputError("navigator 'goal': expected world.goal, found none")
        if parts.planner is None or parts.local_planner is None or parts.controller is None:
            raise InputError(
                "navigator 'goal': expected stack.planner, stack.local_planner and stack.controller, "
                "found one of them missing"
            )
        self._config = config
        self._goal = task.goal
        self._tolerance_m = task.goal_tolerance_m
        self._radius_m = robot.radius_m
        self._localizer = parts.localizer
        self._reactive = parts.reactive
        self._mapper = parts.mapper
        self._map = OwnMap(chart.walls, parts.mapper)
        self._escape = parts.escape
        self._plan = GlobalPlan(
            parts.planner,
            parts.smoother,
            chart,
            robot.streams.stream("planner"),
            journal,
            robot.radius_m + config.guard.margin_m,
        )
        self._follower = WaypointFollower(parts.local_planner, parts.controller, robot.dt_s)
        self._guard = ArcGuard(config.guard, robot.radius_m)
        self._lost = LostDriving(config.wander, robot, parts.localizer)
        self._t_s = 0.0
        self._status, self._reason = StackStatus.RUNNING, ""
        self._mode = Mode.FOLLOW
        self._to_go_m = math.nan
        self._stall = StallWatch(config.stall_progress_m, config.stall_s)
        self._trail: list[Pose2] = []
        self._avoiding = self._escaping = self._in_hall = self._looks_around = False
        self._reaction = NO_REACTION
        self._journal = journal
        self._telemetry = journal.channel(COLUMNS, first=True)
        journal.result("mapped_circles_m", lambda: self._map.found_circles_m)
        journal.counts |= {"attempts": 0, "replans": 0, "escapes": 0}
        self._plan_ahead()

    # --- the plug -----------------------------------------------------------------------------------

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Running, arrived or failed, and why."""
        return self._status, self._reason

    def _plan_ahead(self) -> None:
        """Plan from the initial belief; without a path the task has failed before it starts.

        A robot that is lost plans once it knows where it is. One that believes to stand where there is no
        room for a plan first looks around: the belief may be as far off as its covariance says.
        """
        if self.belief.status is BeliefStatus.LOST:
            return
        result = self._plan.make(
            0.0, self.belief.pose, self._goal, self._map.found_circles_m, (self._plan.clearance_m,)
        )
        if result.status is PlanStatus.START_BLOCKED:
            self._looks_around = True
            self._say("look-around", f"{result.reason}: looking around before planning")
        elif result.path is None:
            self._fail(f"{result.status}: {result.reason}")
        else:
            self._took_plan("plan")

    def step(self, readings: Readings) -> Twist:
        """One control step."""
        command = self._decide(readings)
        self._tell()
        return command

    def _decide(self, readings: Readings) -> Twist:
        self._t_s = readings.t_s
        belief = self._localizer.step(readings)
        self._follower.rest()
        self._reaction = NO_REACTION
        if self._status is not StackStatus.RUNNING:
            return STOP
        if belief.status is BeliefStatus.LOST:
            return self._wander_about(readings)
        if self._looks_around:
            return self._look_around(belief.pose)
        if self._mapper is not None:
            self._mapper.step(readings, belief)
        if self._lost.active:
            return self._find_the_way_again(readings, belief.pose)
        command = self._drive(readings, belief.pose)
        # Its own trail it has driven before: there only the known walls are asked.
        circles = self._map.known_circles_m if self._mode is Mode.ESCAPE else self._map.circles_m
        if self._guard.allows(command, belief.pose, self._map.walls, circles, self._room_asked_m()):
            return command
        return self._refuse(command, belief.pose)

    def _tell(self) -> None:
        reference, control = self._follower.reference, self._follower.control
        x_m, y_m, theta_rad = (
            (math.nan, math.nan, math.nan)
            if reference is None
            else (reference.x_m, reference.y_m, reference.theta_rad)
        )
        self._telemetry.tell(
            x_m,
            y_m,
            theta_rad,
            self._follower.feedforward.w_rad_s,
            control.proportional_rad_s,
            control.integral_rad_s,
            self._reaction.w_rad_s,
            control.error_m,
            self._mode,
            self._to_go_m,
        )

    # --- the loop -----------------------------------------------------------------------------------

    def _drive(self, readings: Readings, pose: Pose2) -> Twist:
        assert self._plan.progress is not None
        self._to_go_m = self._plan.progress.update(pose)
        if self._escaping:
            return self._continue_escape(pose)
        self._trail.append(pose)
        if self._reactive is not None:
            self._reaction = self._reactive.step(
                readings, pose, self._map.walls, self._plan.circles_m, self._goes_straight()
            )
        kind = self._reaction.kind
        if kind is ReactionKind.TRAPPED:
            return self._begin_escape("turning found no way out")
        if self._stall.stalled(self._to_go_m, self._t_s):
            return self._begin_escape(f"no progress for {self._config.stall_s:g} s")
        if kind is ReactionKind.AVOID:
            return self._avoid()
        if self._avoiding:
            self._avoiding = False
            self._follower.drop()
            self._say("avoid-end", "the way in front is free again")
        if kind is ReactionKind.HALL and not self._near_goal():
            return self._take_the_middle()
        if self._in_hall:
            self._in_hall = False
            self._follower.drop()
        return self._follow(pose)

    def _look_around(self, pose: Pose2) -> Twist:
        """Stand still while the sensors correct the start pose, then plan from where the robot truly is."""
        self._mode = Mode.REPLAN
        if self._t_s < self._config.look_around_s:
            return STOP
        self._looks_around = False
        result = self._plan.make(
            self._t_s, pose, self._goal, self._map.found_circles_m, self._clearances(pose)
        )
        if result.path is None:
            return self._fail(f"{result.status}: {result.reason}")
        self._took_plan("plan", "looked around")
        return STOP

    def _wander_about(self, readings: Readings) -> Twist:
        """Lost: keep clear of everything and look around until the localizer knows more."""
        if not self._lost.active:
            self._lost.active = True
            self._avoiding = self._escaping = self._in_hall = self._looks_around = False
            self._follower.drop()
            self._say("lost", "the robot does not know where it is: wandering until it does")
        self._mode = Mode.WANDER
        return self._lost.step(readings)

    def _find_the_way_again(self, readings: Readings, pose: Pose2) -> Twist:
        """Plan from where the robot found itself; drive on as before while there is no room for a plan."""
        self._mode = Mode.WANDER
        if self._t_s < self._lost.plan_at_s:
            return self._lost.step(readings)
        result = self._plan.make(
            self._t_s, pose, self._goal, self._map.found_circles_m, self._clearances(pose)
        )
        self._journal.count("replans")
        if result.path is None:
            if self._journal.counts["replans"] >= self._config.max_replans:
                return self._fail(f"stuck: found itself, but {result.status} ({result.reason})")
            self._lost.plan_at_s = self._t_s + PLAN_AGAIN_S
            return self._lost.step(readings)
        self._lost.active = False
        self._trail = []
        if self._reactive is not None:
            self._reactive.reset()
        self._took_plan("found", f"the robot knows where it is, ({pose.x_m:.2f}, {pose.y_m:.2f})")
        return STOP

    def _follow(self, pose: Pose2) -> Twist:
        """Follow the local path; plan a new one at each waypoint; replan globally where none leads on."""
        if not self._follower.active:
            if self._near_goal():
                return self._arrive()
            if not self._replan_locally(pose):
                return self._replan_globally(pose, "no next waypoint can be reached on the robot's own map")
        elif self._path_is_blocked():
            return self._replan_globally(pose, "a mapped obstacle stands on the local path")
        command = self._follower.step(pose)
        self._mode = Mode.FOLLOW
        if self._reaction.kind is ReactionKind.LATERAL:
            self._mode = Mode.LATERAL
            return Twist(command.v_m_s, command.w_rad_s + self._reaction.w_rad_s)
        return command

    def _avoid(self) -> Twist:
        self._mode = Mode.AVOID
        if not self._avoiding:
            self._avoiding = True
            self._journal.count("attempts")
            side = "left" if self._reaction.w_rad_s > 0.0 else "right"
            self._say(
                "avoid-start",
                f"something unexpected {self._reaction.front_m:.2f} m ahead: turning {side}, "
                f"attempt {self._journal.counts['attempts']}",
            )
        return Twist(self._reaction.speed_limit_m_s, self._reaction.w_rad_s)

    def _take_the_middle(self) -> Twist:
        self._mode = Mode.LATERAL
        if not self._in_hall:
            self._in_hall = True
            self._say("hall", "walls close on both sides: taking the middle")
        self._follower.drop()
        return Twist(self._config.cruise_speed_m_s, self._reaction.w_rad_s)

    # --- escapes and replans ------------------------------------------------------------------------

    def _begin_escape(self, why: str) -> Twist:
        if self._escape is None:
            return self._fail(f"stuck: {why}, and the stack has no escape")
        self._journal.count("escapes")
        self._say("escape", f"{why}: backing out the way it came")
        self._escape.begin(self._trail)
        self._escaping = True
        self._avoiding = False
        self._follower.drop()
        self._mode = Mode.ESCAPE
        return STOP

    def _continue_escape(self, pose: Pose2) -> Twist:
        assert self._escape is not None
        command = self._escape.step(pose)
        self._mode = Mode.ESCAPE
        if command is not None:
            return command
        self._escaping = False
        if self._reactive is not None:
            self._reactive.reset()
        return self._replan_globally(pose, "backed out")

    def _replan_locally(self, pose: Pose2) -> bool:
        assert self._plan.progress is not None
        route = self._plan.progress.route_ahead(self._config.waypoint_ahead_m)
        return self._follower.replan(pose, route, self._map.walls, self._map.circles_m)

    def _replan_globally(self, pose: Pose2, why: str) -> Twist:
        """Plan anew on the robot's own map; back out where even that finds no way."""
        self._mode = Mode.REPLAN
        self._follower.drop()
        if self._journal.counts["replans"] >= self._config.max_replans:
            return self._fail(f"stuck: gave up after {self._journal.counts['replans']} replans")
        self._journal.count("replans")
        result = self._plan.make(
            self._t_s, pose, self._goal, self._map.found_circles_m, self._clearances(pose)
        )
        if result.path is None:
            return self._begin_escape(f"replanning found {result.status} ({result.reason})")
        self._took_plan("replan", why)
        return STOP

    def _took_plan(self, kind: str, why: str = "") -> None:
        plan = self._journal.plans[-1]
        self._stall.restart(self._t_s)
        self._to_go_m = plan.length_m
        because = f"{why}: " if why else ""
        self._say(
            kind, f"{because}{plan.length_m:.2f} m to go, planned in {plan.planning_time_s * 1e3:.0f} ms"
        )

    def _refuse(self, command: Twist, pose: Pose2) -> Twist:
        """A command that the guard refuses: turn on the spot, or think again."""
        if self._mode is Mode.AVOID:
            return Twist(0.0, command.w_rad_s)
        if self._mode is Mode.ESCAPE:
            self._escaping = False
            return self._replan_globally(pose, "the way back is blocked")
        return self._replan_globally(pose, "the robot's own map leaves no room for the command")

    # --- questions ----------------------------------------------------------------------------------

    def _clearances(self, pose: Pose2) -> list[float]:
        """Clearances to try in turn: the planner's own, the fallbacks, and what there is where it stands."""
        config = self._config
        here = self._map.distance_m(pose)
        asked = [self._plan.clearance_m, *(self._radius_m + margin for margin in config.fallback_margins_m)]
        squeezed = max(here - HERE_TOLERANCE_M, self._radius_m - MAPPED_TOLERANCE_M)
        return [c for c in asked if c <= self._plan.clearance_m] + (
            [squeezed] if squeezed < min(asked) else []
        )

    def _room_asked_m(self) -> float:
        """What the guard may ask for: what the plan keeps, and on its own trail only what the body needs."""
        if self._mode is Mode.ESCAPE:
            return self._radius_m + HERE_TOLERANCE_M
        return self._journal.plans[-1].clearance_m - HERE_TOLERANCE_M

    def _goes_straight(self) -> bool:
        assert self._plan.progress is not None
        turn = self._plan.progress.turn_ahead_rad(self._config.straight_ahead_m)
        return turn < self._config.straight_below_rad

    def _path_is_blocked(self) -> bool:
        if self._mapper is None or self._config.watch_ahead_m == 0.0:
            return False
        ahead = self._follower.clearance_ahead_m(self._config.watch_ahead_m, self._mapper.circles_m)
        return ahead < min(self._radius_m + self._config.watch_margin_m, self._room_asked_m())

    def _near_goal(self) -> bool:
        """Whether this is the end: near the goal, and not merely passing by it with way left to go."""
        pose = self.belief.pose
        away = math.hypot(pose.x_m - self._goal.x_m, pose.y_m - self._goal.y_m)
        if self._to_go_m > away + self._tolerance_m:
            return False
        return away <= self._config.arrival_m or (away <= self._tolerance_m and self._to_go_m < 0.02)

    # --- ends ---------------------------------------------------------------------------------------

    def _arrive(self) -> Twist:
        self._status, self._mode = StackStatus.ARRIVED, Mode.ARRIVED
        self._say("arrived", "the robot says that it has reached its goal")
        return STOP

    def _fail(self, why: str) -> Twist:
        self._status, self._reason = StackStatus.FAILED, why
        self._say("failed", why)
        return STOP

    def _say(self, kind: str, text: str) -> None:
        self._journal.say(self._t_s, kind, text)
