"""The navigator that drives to its goal by what the laser shows, along a plan where there is a planner."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.give_way import GiveWay, GiveWayConfig
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.navigator.plan_ahead import PlanAhead, PlanAheadConfig
from pilotage.stack.perception.moving_bodies import MovingBodies, MovingBodiesConfig

PASSING_M = 0.05
"""A point on the plan is no place to stop at: only this near is it reached."""


class LocalConfig(Config):
    """What no data sheet says of the robot, and when it is there."""

    reverse_m_s: NonNegative = 0.5
    """Fastest backwards, never above the forward speed; 0 for a robot that does not see behind it."""
    arrival_m: float | None = Field(default=None, gt=0.0)
    """How near it has to believe to be; None: the goal's tolerance."""
    shift_m: Positive = 0.1
    """The goal is placed anew in the odometry's frame where the localizer's correction moves it farther."""
    plan: PlanAheadConfig = PlanAheadConfig()
    """How the stack's planner leads, if it has one."""
    moving_bodies: MovingBodiesConfig = MovingBodiesConfig()
    give_way: GiveWayConfig = GiveWayConfig()
    """With a plan the robot knows the walls, and so who walks about."""


@NAVIGATORS.add("local", LocalConfig)
class LocalNavigator:
    """Hands laser, odometry and goal to the local controller, and its command on.

    The controller sees poses that are integrated from the odometry alone, which drift but do not jump.
    Without a localizer the belief is dead reckoned; with one the goal stays where the localizer has it.
    With a planner the controller is led along its plan on the robot's own map, to which a mapper adds what
    it sees; without, it heads for the goal itself, which fails where the way leads far around. Between two
    scans the last command stands. Fails where the robot cannot turn on the spot: the controllers reckon
    with it.
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
        if task.goal is None:
            raise InputError("navigator 'local': expected world.goal, found none")
        if parts.local_controller is None:
            raise InputError("navigator 'local': expected stack.local_controller, found none")
        self._journal = journal
        self._goal_xy_m = (task.goal.x_m, task.goal.y_m)
        self._drive = LocalDrive(
            parts.local_controller,
            robot,
            task.initial.pose,
            reverse_m_s=config.reverse_m_s,
            shift_m=config.shift_m,
            needed_by="navigator 'local'",
            goal_xy_m=self._goal_xy_m,
        )
        self._localizer: Localizer = parts.localizer or DeadReckoningLocalizer(
            DeadReckoningConfig(), robot, chart, task.initial, journal
        )
        self._bodies = MovingBodies(config.moving_bodies, robot, chart)
        self._gives_way = GiveWay(config.give_way, robot, self._bodies)
        self._plan: PlanAhead | None = None
        if parts.planner is not None:
            self._plan = PlanAhead(
                config.plan,
                robot,
                chart,
                task.goal,
                parts.planner,
                parts.smoother,
                parts.mapper,
                self._bodies,
                self._localizer.belief,
                journal,
            )
        self._tolerance_m = min(config.arrival_m or math.inf, task.goal_tolerance_m)
        self._status, self._reason, self._word = StackStatus.RUNNING, "", ""
        self._channel = journal.channel({"distance_to_go_m": "m"}, first=True)

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived where the controller says so."""
        return self._status, self._reason

    def step(self, readings: Readings) -> Twist:
        """Localize, move the odometry's pose on, and ask the controller where there is a scan."""
        belief = self._localizer.step(readings)
        pose = belief.pose
        self._drive.move(readings)
        away_m = math.hypot(self._goal_xy_m[0] - pose.x_m, self._goal_xy_m[1] - pose.y_m)
        if self._status is not StackStatus.RUNNING:
            self._channel.tell(away_m)
            return STOP
        point, tolerance_m = self._goal_xy_m, self._tolerance_m
        if self._plan is not None:
            point = self._plan.lead(readings, belief)
            away_m = self._plan.to_go_m
            if self._plan.failure:
                self._end(readings.t_s, StackStatus.FAILED, self._plan.failure)
                return STOP
        self._channel.tell(away_m)
        led = point != self._goal_xy_m
        command = self._drive.toward(
            point, pose, readings, min(PASSING_M, tolerance_m) if led else tolerance_m, self._bodies.about
        )
        if self._plan is not None and not self._gives_way.allows(command, pose, self._plan.mapped_m):
            command = STOP
        self._tell(readings.t_s, led=led)
        return STOP if self._status is not StackStatus.RUNNING else command

    def _tell(self, t_s: float, *, led: bool) -> None:
        word = self._drive.status
        if word == "arrived" and not led:
            self._end(t_s, StackStatus.ARRIVED, f"within {self._tolerance_m:g} m of the goal")
        elif word == "closed" and word != self._word:
            self._journal.count("closed")
        self._word = word

    def _end(self, t_s: float, status: StackStatus, why: str) -> None:
        self._status, self._reason = status, why
        self._journal.say(t_s, str(status), why)
