"""The navigator that drives to its goal by what the laser shows, along a plan where there is a planner."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.give_way import GiveWay, GiveWayConfig
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.control.make_room import MakeRoom, MakeRoomConfig
from pilotage.stack.control.step_clear import StepClear
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Abilities, Localizer
from pilotage.stack.navigator.navigator import (
    Parts,
    arrival_within_m,
    check_for_centre,
    only_goal,
    turn_at_goal_rad,
    turned_by,
    unexplained_of,
)
from pilotage.stack.navigator.plan_ahead import PlanAhead, PlanAheadConfig
from pilotage.stack.navigator.state import LocalizingNavigator, Standing
from pilotage.stack.navigator.wandering import Wandering
from pilotage.stack.perception.moving_bodies import MovingBodies, MovingBodiesConfig

PASSING_M = 0.05
"""A point on the plan is no place to stop at: only this near is it reached."""


class LocalConfig(Config):
    """What no data sheet says of the robot, and when it is there."""

    reverse_m_s: NonNegative = 0.5
    """Fastest backwards, never above the forward speed; 0 for a robot that does not see behind it."""
    arrival_m: float | None = Field(default=None, gt=0.0)
    """How near it has to believe to be; None: half the goal's tolerance, its error may be the other half."""
    shift_m: Positive = 0.1
    """The goal is placed anew in the odometry's frame where the localizer's correction moves it farther."""
    plan: PlanAheadConfig = PlanAheadConfig()
    """How the stack's planner leads, if it has one."""
    moving_bodies: MovingBodiesConfig = MovingBodiesConfig()
    give_way: GiveWayConfig = GiveWayConfig()
    """With a plan the robot knows the walls, and so who walks about."""
    make_room: MakeRoomConfig = MakeRoomConfig()
    shut_in_s: Positive = 6.0
    shut_in_m: Positive = 0.3
    """Having come no farther than this among people in that time, it makes room."""
    wander: WanderConfig = WanderConfig()
    """What it does alone on its floor while it does not know where it is."""


@NAVIGATORS.add("local", LocalConfig)
class LocalNavigator(LocalizingNavigator):
    """Hands laser, odometry and goal to the local controller, and its command on.

    The controller sees poses that are integrated from the odometry alone, which drift but do not jump.
    Where the goal has a heading it turns to it on the spot, if its corners have room there. Without a
    localizer the belief is dead reckoned; with one the goal stays where the localizer has it. With a
    planner the controller is led along its plan on the robot's own map, to which a mapper adds what it
    sees; without, it heads for the goal itself, which fails where the way leads far around. Between two
    scans the last command stands. While its localizer is lost it wanders by the laser, and among others
    stands. Fails where the robot cannot turn on the spot: the controllers reckon with it.
    """

    def __init__(
        self,
        config: LocalConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        goal = only_goal(task, "local")
        if goal is None:
            raise InputError("navigator 'local': expected world.goal, found none")
        if parts.local_controller is None:
            raise InputError("navigator 'local': expected stack.local_controller, found none")
        check_for_centre(parts, "local")
        self._goal_xy_m, self._task = (goal.x_m, goal.y_m), task
        self._robot = robot
        self._drive = LocalDrive(
            parts.local_controller,
            robot,
            task.initial.pose,
            reverse_m_s=config.reverse_m_s,
            shift_m=config.shift_m,
            needed_by="navigator 'local'",
            goal_xy_m=self._goal_xy_m,
            localized=parts.localizer is not None and Abilities.of(parts.localizer).corrects,
        )
        localizer: Localizer = parts.localizer or DeadReckoningLocalizer(
            DeadReckoningConfig(), robot, chart, task.initial, journal
        )
        super().__init__(localizer, Standing(journal))
        self._last_word = LastWord(robot)
        self._step_clear = StepClear(robot, self._last_word)
        self._wandering = Wandering(config.wander, robot, localizer, self._last_word)
        self._bodies = MovingBodies(
            config.moving_bodies, robot, chart, mates=task.mates, unexplained=unexplained_of(parts)
        )
        self._gives_way = GiveWay(config.give_way, robot, self._bodies)
        self._make_room = MakeRoom(config.make_room, robot, chart.field, self._bodies)
        self._shut_in = config.shut_in_s, config.shut_in_m
        self._stood: tuple[float, Pose2] | None = None
        self._makes_room = self._lost = False
        self._plan: PlanAhead | None = None
        if parts.planner is not None:
            self._plan = PlanAhead(
                config.plan,
                robot,
                chart,
                goal,
                parts.planner,
                parts.smoother,
                parts.mapper,
                self._bodies,
                self._localizer.belief,
                journal,
            )
        self._tolerance_m = arrival_within_m(config.arrival_m, task.goal_tolerance_m)
        self._word = ""
        self._channel = journal.channel({"distance_to_go_m": "m"}, first=True)

    def step(self, readings: Readings) -> Twist:
        """Localize, move the odometry's pose on, and ask the controller where there is a scan."""
        belief = self._localizer.step(readings)
        self._drive.move(readings)
        self._last_word.take_in(readings)
        return self._last_word.leaving(self._command(readings, belief))

    def _command(self, readings: Readings, belief: Belief) -> Twist:
        pose = belief.pose
        away_m = math.hypot(self._goal_xy_m[0] - pose.x_m, self._goal_xy_m[1] - pose.y_m)
        if self._is_lost(readings.t_s, belief):
            # Where the goal is nobody knows: a belief that was given up lies in the middle of the map.
            self._channel.tell(math.nan)
            alone = not (self._task.mates or self._bodies.about)
            return self._wandering.step(readings) if alone else STOP
        if self._standing.is_over:
            self._channel.tell(away_m)
            return STOP
        point, tolerance_m = self._goal_xy_m, self._tolerance_m
        if self._plan is not None:
            point = self._plan.lead(readings, belief)
            away_m = self._plan.to_go_m
            if self._plan.failure:
                self._standing.end(readings.t_s, StackStatus.FAILED, self._plan.failure)
                return STOP
        self._channel.tell(away_m)
        led = point != self._goal_xy_m
        command = self._drive.toward(
            point, belief, readings, min(PASSING_M, tolerance_m) if led else tolerance_m, self._bodies.about
        )
        arrives = not led and self._drive.status == "arrived"
        off_rad = turn_at_goal_rad(self._task, pose) if arrives and self._has_room_to_turn() else 0.0
        if off_rad:
            command = turned_by(off_rad, self._robot.motion.top_turn_rate_rad_s)
        if self._plan is not None:
            command = self._among_people(readings.t_s, command, pose, self._plan.mapped_m)
        # Weak brakes would carry it through the goal: it stops first, and comes back.
        there = not (led or off_rad) and (abs(self._drive.rolls_m()) <= self._task.goal_tolerance_m)
        self._tell(readings.t_s, there=there)
        if self._standing.is_over:
            return STOP
        mapped_m = None if self._plan is None else self._plan.mapped_m

        def leaves_alone(step: Twist) -> bool:
            return mapped_m is None or self._gives_way.allows(step, pose, mapped_m)

        return self._step_clear.instead_of(command, readings.t_s, leaves_alone)

    def _is_lost(self, t_s: float, belief: Belief) -> bool:
        """Whether it does not know where it is, yet or any more."""
        lost = belief.status is BeliefStatus.LOST and not self._standing.is_over
        if lost != self._lost:
            what = "does not know where it is" if lost else "knows where it is, goes on"
            self._standing.journal.say(t_s, "lost" if lost else "found", f"the robot {what}")
        self._lost = lost
        return lost

    def _among_people(self, t_s: float, command: Twist, pose: Pose2, mapped_m: FloatArray) -> Twist:
        """The command as people leave it: making room where they shut the robot in, else giving way."""
        longest_s, least_m = self._shut_in
        if self._stood is None or _apart_m(pose, self._stood[1]) > least_m or not self._bodies.about:
            self._stood = t_s, pose
        waited = t_s - self._stood[0] >= longest_s
        if waited and not self._makes_room and self._make_room.helps(pose, mapped_m):
            self._standing.journal.say(t_s, "make-room", "somebody stands in the way: making room")
            self._make_room.begin(t_s)
            self._makes_room = True
        if self._makes_room:
            room = self._make_room.step(t_s, pose, mapped_m)
            if room is None:
                self._makes_room, self._stood = False, (t_s, pose)
            else:
                command = room
        return command if self._gives_way.allows(command, pose, mapped_m) else STOP

    def _has_room_to_turn(self) -> bool:
        """Whether no corner can touch what the last scan shows: a turn changes no distance from the axle."""
        return self._robot.footprint.is_disc or self._drive.nearest_seen_m() > self._robot.radius_m

    def _tell(self, t_s: float, *, there: bool) -> None:
        word = self._drive.status
        if word == "arrived" and there:
            self._standing.end(t_s, StackStatus.ARRIVED, f"within {self._tolerance_m:g} m of the goal")
        elif word == "closed" and word != self._word:
            self._standing.journal.count("closed")
        self._word = word


def _apart_m(a: Pose2, b: Pose2) -> float:
    return math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
