"""The explorer's plug: localize, map, decide now and then, and drive where that leads."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.control.step_clear import StepClear
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.localizer import Abilities
from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig
from pilotage.stack.navigator.floor_explorer.context import Context
from pilotage.stack.navigator.floor_explorer.decisions import decide, is_there
from pilotage.stack.navigator.floor_explorer.own_floor import OwnFloor
from pilotage.stack.navigator.floor_explorer.states import Exploring, State
from pilotage.stack.navigator.floor_explorer.targets import Targets
from pilotage.stack.navigator.navigator import Parts, localizer_of
from pilotage.stack.navigator.state import LocalizingNavigator

COUNTS = ("frontiers_seen", "frontiers_left", "frontiers_given_up", "loops_sought")
COLUMNS = {"goal_x_m": "m", "goal_y_m": "m", "frontiers": "1", "position_std_m": "m"}


@NAVIGATORS.add("floor-frontier", FloorExplorerConfig)
class FloorExplorer(LocalizingNavigator):
    """Explores a floor with a laser scanner until no frontier is left that it can look at.

    Goes to the nearest frontier (Yamauchi, 1997), long ones a little sooner; paths are planned over seen free
    floor, and driven by the local controller, which sees what is near by itself. Where its position becomes
    unsure it goes back to the place that it knows best, for the localizer to close a loop there (active
    loop closing: Stachniss, Haehnel and Burgard, 2004). In the end it returns to its start.

    The map is the localizer's where that makes one (``slam``), else it is drawn from scans at the poses that
    the localizer tells; with the oracle ``localizer`` that is exploration with a perfect pose.

    A frontier is looked at from near it first. One that stays (the edge of a shadow, beside a door post) and
    that the robot fits through is driven to, and given up only where it stood on it, or got no nearer. One
    that is too narrow is given up when it was looked at. What is given up is said, with the reason.

    Frontiers with walls in sight come first, and rooms that are seen through gaps without room for its
    clearance last, by paths that its body takes.
    """

    CHOOSES_PLACES: ClassVar[bool] = True

    def __init__(
        self,
        config: FloorExplorerConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        del chart  # it knows nothing of the floor
        if parts.local_controller is None:
            raise InputError("navigator 'floor-frontier': expected stack.local_controller, found none")
        localizer = localizer_of(parts, "floor-frontier")
        self._lidar, scanner = robot.one_sensor(LidarConfig, "navigator 'floor-frontier'")
        start = task.initial.pose
        self._drive = LocalDrive(
            parts.local_controller,
            robot,
            start,
            reverse_m_s=config.reverse_m_s,
            needed_by="navigator 'floor-frontier'",
        )
        self._last_word = LastWord(robot)
        self._step_clear = StepClear(robot, self._last_word)
        scans = Abilities.of(localizer).scan_grid
        self._own = OwnFloor(config, scanner, scans, np.array([start.x_m, start.y_m]), robot.radius_m)
        targets, top_speed_m_s = Targets(config, scanner.max_range_m), robot.motion.top_speed_m_s
        self._context = Context(config, self._own, targets, localizer, top_speed_m_s, journal)
        super().__init__(localizer, self._context)
        self._state: State = Exploring()
        self._decided_s = -math.inf
        journal.result("grid", self._own.left)
        journal.counts |= dict.fromkeys(COUNTS, 0)
        self._channel = journal.channel(COLUMNS, first=True)

    def step(self, readings: Readings) -> Twist:
        """Localize, look whether there is something better to do, and drive."""
        belief = self._localizer.step(readings)
        self._drive.move(readings)
        self._last_word.take_in(readings)
        scan = readings.by_sensor.get(self._lidar)
        if self._own.draws and isinstance(scan, LidarScan):
            self._own.draw(scan, belief.pose)
        return self._last_word.leaving(self._command(readings, belief))

    def _command(self, readings: Readings, belief: Belief) -> Twist:
        context, t_s = self._context, readings.t_s
        if context.status is not StackStatus.RUNNING or not len(self._own.grid.poses):
            return STOP
        here = np.array([belief.pose.x_m, belief.pose.y_m])
        if t_s - self._decided_s >= context.config.replan_s or is_there(context, self._state, here):
            self._decided_s = t_s
            self._state = decide(context, self._state, t_s, belief)
        target = self._state.target
        goal = (math.nan, math.nan) if target is None else (float(target.xy_m[0]), float(target.xy_m[1]))
        self._channel.tell(*goal, float(context.frontiers), belief.std_m)
        if target is None:
            return STOP
        tolerance_m = 0.5 * self._state.within_m(context.config)
        command = self._drive.toward(context.led_to(target.path, here), belief, readings, tolerance_m)
        return self._step_clear.instead_of(command, t_s)
