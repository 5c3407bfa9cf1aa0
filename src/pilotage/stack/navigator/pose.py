"""The navigator that moves to a pose by a control law, without a path."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.polar_pose import PolarPoseConfig, PolarPoseController
from pilotage.stack.interface import NAVIGATORS, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import (
    AROUND,
    Parts,
    arrival_within_m,
    localizer_of,
    only_goal,
    turn_at_goal_rad,
    turned_by,
)
from pilotage.stack.navigator.state import LocalizingNavigator, Standing


class PoseConfig(PolarPoseConfig):
    """The law's gains, and when it is there."""

    arrival_m: float | None = Field(default=None, gt=0.0)
    """How near it has to believe to be; None: half the goal's tolerance, its error may be the other half."""
    patience_s: Positive = 20.0
    """It stands for so long before what its lasers show in its way."""


@NAVIGATORS.add("pose", PoseConfig)
class PoseNavigator(LocalizingNavigator):
    """Drives by the polar law from where it believes to be (rover report, chapter 2).

    Arrives at the first step at which it believes to be near enough; who can turn on the spot does so there
    for the goal's heading, where its lasers show room. It knows no way around anything: before
    what its lasers show in its way it stands, and fails where that stays; what they do not show it drives
    over.
    """

    def __init__(
        self,
        config: PoseConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        del chart
        goal = only_goal(task, "pose")
        if goal is None or goal.theta_rad is None:
            raise InputError("navigator 'pose': expected world.goal with theta_rad, found none")
        super().__init__(localizer_of(parts, "pose"), Standing(journal))
        pose = Pose2(goal.x_m, goal.y_m, goal.theta_rad)
        self._law = PolarPoseController(config, pose, robot.motion, robot.dt_s)
        self._tolerance_m = arrival_within_m(config.arrival_m, task.goal_tolerance_m)
        self._last_word, self._patience_s = LastWord(robot), config.patience_s
        self._task, self._motion, self._is_there = task, robot.motion, False
        self._channel = journal.channel({"distance_to_go_m": "m"})

    def step(self, readings: Readings) -> Twist:
        """Localize, and steer by distance and two angles."""
        pose = self._localizer.step(readings).pose
        to_go_m = self._law.distance_m(pose.x_m, pose.y_m)
        self._channel.tell(to_go_m)
        self._last_word.take_in(readings)
        return self._last_word.leaving(self._command(readings, pose, to_go_m))

    def _command(self, readings: Readings, pose: Pose2, to_go_m: float) -> Twist:
        if self._standing.is_over:
            return STOP
        self._is_there |= to_go_m <= self._tolerance_m
        if self._is_there:
            turn = self._turn(pose)
            if turn is not None and self._last_word.allows(turn):
                return turn
            self._standing.end(
                readings.t_s, StackStatus.ARRIVED, f"within {self._tolerance_m:g} m of the goal"
            )
            return STOP
        twist = self._law.command(pose.x_m, pose.y_m, pose.theta_rad)
        if not math.isfinite(twist.w_rad_s):
            return STOP
        if self._last_word.allows(twist):
            return twist
        if self._last_word.held_s >= self._patience_s:
            self._standing.end(readings.t_s, StackStatus.FAILED, f"stuck: {self._last_word.why}{AROUND}")
        return STOP

    def _turn(self, pose: Pose2) -> Twist | None:
        """What is left of the goal's heading; None where it is there, or has to drive to turn."""
        off_rad = turn_at_goal_rad(self._task, pose)
        if not off_rad or self._motion.least_turning_radius_m > 0.0:
            return None
        return turned_by(off_rad, self._motion.top_turn_rate_rad_s)
