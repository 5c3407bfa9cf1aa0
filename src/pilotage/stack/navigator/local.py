"""The navigator that drives to its goal by what the laser shows: no map, no plan."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.navigator.navigator import Parts


class LocalConfig(Config):
    """What no data sheet says of the robot, and when it is there."""

    reverse_m_s: NonNegative = 0.5
    """Fastest backwards, never above the forward speed; 0 for a robot that does not see behind it."""
    arrival_m: float | None = Field(default=None, gt=0.0)
    """How near it has to believe to be; None: the goal's tolerance."""
    shift_m: Positive = 0.1
    """The goal is placed anew in the odometry's frame where the localizer's correction moves it farther."""


@NAVIGATORS.add("local", LocalConfig)
class LocalNavigator:
    """Hands laser, odometry and goal to the local controller, and its command on.

    The controller sees poses that are integrated from the odometry alone, which drift but do not jump.
    Without a localizer the belief is dead reckoned; with one the goal stays where the localizer has it.
    Between two scans the last command stands. Fails where the robot cannot turn on the spot: the
    controllers reckon with it.
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
        belief = self._localizer.step(readings).pose
        self._drive.move(readings)
        self._channel.tell(math.hypot(self._goal_xy_m[0] - belief.x_m, self._goal_xy_m[1] - belief.y_m))
        if self._status is not StackStatus.RUNNING:
            return STOP
        command = self._drive.toward(self._goal_xy_m, belief, readings, self._tolerance_m)
        self._tell(readings.t_s)
        return STOP if self._status is not StackStatus.RUNNING else command

    def _tell(self, t_s: float) -> None:
        word = self._drive.status
        if word == "arrived":
            self._status, self._reason = StackStatus.ARRIVED, f"within {self._tolerance_m:g} m of the goal"
            self._journal.say(t_s, "arrived", self._reason)
        elif word == "closed" and word != self._word:
            self._journal.count("closed")
        self._word = word
