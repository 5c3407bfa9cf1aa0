"""The report's explorer: look north, south, east and west; else hop to the nearest explored cell."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STANDSTILL, BoolArray, WheelSpeeds
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.maps.world_map import WorldMap
from pilotage.missions.explorer import ExplorerConfig
from pilotage.replicas.cell_marks import CellMarks
from pilotage.replicas.potential_field import PotentialField, PotentialFieldConfig
from pilotage.replicas.wheel_pose import WheelPose
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.wheel_pursuit import pursue, turn
from pilotage.stack.exploration.explorer import ExplorerParts, LeftCell, offer
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, SheetKnowledge, TaskKnowledge

AROUND = ((1, 0), (-1, 0), (0, 1), (0, -1))
"""North, south, east, west, in the report's order: (rows, columns)."""
FACING_RAD = 0.1


class SurroundCheckConfig(ExplorerConfig):
    """The report's numbers; ``avoid`` says when the potential field acts where the mission switches it on."""

    goal_tolerance_m: Positive = 0.020
    planning_period_s: Positive = 0.1
    stuck_periods: int = Field(default=200, ge=1)
    """A goal is dropped after so many control periods with less than 10 mm of progress each: after 2 s."""
    far_cells: Positive = 1.5
    """A hop is far where its goal lies more cells away than this."""
    margin_cells: int = Field(default=3, ge=0)
    """The outermost cells, which it neither visits nor explores. All its printed maps keep 3 cells away from
    the edge: pose errors take it over the edge much less often, and a third of the map stays unknown."""
    avoid: Literal["far-hops", "always"] = "far-hops"
    field: PotentialFieldConfig = PotentialFieldConfig()
    give_up_s: Positive = 60.0
    """Stuck where no cell was new for so long."""


@NAVIGATORS.add("surround-check", SurroundCheckConfig)
class SurroundCheck:
    """Next cell by the states around (exploration report, ch. 2.1): explored first, unknown as a heading.

    Where none of the four is either, it hops to the nearest explored cell by straight distance, whatever
    stands between; a goal that takes too long is dropped and chosen anew. With ``avoid: always`` the
    potential field also acts on the way to the next cell, and a goal that was dropped after the field had
    acted is passed over until another one was reached, so that the field does not block the explorer.
    Fails by its pose, and where the nearest explored cell is behind a box.
    """

    CHOOSES_PLACES: ClassVar[bool] = True
    TAKES: ClassVar = frozenset({"pose", "plan", "heading"})

    def __init__(
        self,
        config: SurroundCheckConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: ExplorerParts,
        journal: Journal,
    ) -> None:
        knowledge = SheetKnowledge.of(robot, chart, task, config, "surround-check")
        self._journal = journal
        offer(journal, self)
        self._channel = journal.channel({"goal_x_m": "m", "goal_y_m": "m", "far_hop": "1"})
        self._config = config
        self._drive = knowledge.drive
        self._plan_every = max(1, round(config.planning_period_s / knowledge.dt_s))
        self._pose = WheelPose(knowledge, parts.heading)
        self._marks = CellMarks(knowledge, config.margin_cells)
        infrared = knowledge.sensors_of(InfraredConfig)
        self._field = PotentialField(config.field, infrared, knowledge.drive) if knowledge.avoidance else None
        self._always = config.avoid == "always"
        self._goal: tuple[int, int] | None = None
        self._facing: float | None = None
        self._far = False
        self._slow_periods = 0
        self._bent = False
        self._refused: set[tuple[int, int]] = set()
        self._looked: set[tuple[int, int]] = set()
        self._steps = 0
        self._new_at_s, self._new_count = 0.0, 0
        self._status, self._reason = StackStatus.RUNNING, ""

    @property
    def belief(self) -> Belief:
        """From encoders, with fusion along the fused heading."""
        return self._pose.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Done where nothing explored is left; failed where it got stuck."""
        return self._status, self._reason

    @property
    def cells(self) -> CellMap:
        """The map as printed."""
        return self._marks.cells

    @property
    def visited(self) -> BoolArray:
        """Where it believes to have been."""
        return self._marks.visited

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """The report's robot gave no reasons."""
        return ()

    def step(self, readings: Readings) -> WheelSpeeds:
        """Localize, map, choose, drive."""
        command = self._step(readings)
        x, y = (math.nan, math.nan) if self._goal is None else self._marks.centre_of(*self._goal)
        self._channel.tell(x, y, float(self._far))
        return command

    def _step(self, readings: Readings) -> WheelSpeeds:
        self._steps += 1
        pose = self._pose.step(readings)
        if len(readings.by_sensor) > 2:
            self._marks.step(readings, pose)
            if self._field is not None:
                self._field.sense(readings)
        if self._status is not StackStatus.RUNNING or not self._pose.aligned:
            return STANDSTILL
        self._count_progress(readings.t_s)
        if self._steps % self._plan_every == 0:
            self._plan(readings.t_s)
        if self._goal is not None:
            return self._drive_on()
        if self._facing is not None:
            off = wrap_to_pi(self._facing - pose.theta_rad)
            if abs(off) > FACING_RAD:
                return turn(off, self._drive)
            self._facing = None
        return STANDSTILL

    # --- choosing -----------------------------------------------------------------------------------

    def _plan(self, t_s: float) -> None:
        """Choose the next cell once the last one was reached or dropped."""
        pose = self._pose.pose
        if self._goal is not None:
            x, y = self._marks.centre_of(*self._goal)
            if math.hypot(x - pose.x_m, y - pose.y_m) <= self._config.goal_tolerance_m:
                self._goal = None
                self._refused.clear()
            elif self._marks.state(*self._goal) <= CellState.BORDER:
                self._goal = None  # It has turned out to be no place to go to.
            elif self._slow_periods >= self._config.stuck_periods:
                if self._always and self._bent:
                    self._refused.add(self._goal)
                self._goal = None
        if self._goal is None and self._facing is None:
            self._choose(t_s)

    def _choose(self, t_s: float) -> None:
        pose = self._pose.pose
        here = self._marks.cell_of(pose.x_m, pose.y_m)
        if here is not None:
            around = [(here[0] + row, here[1] + column) for row, column in AROUND]
            for cell in around:
                if self._marks.state(*cell) == CellState.EXPLORED and cell not in self._refused:
                    return self._go(cell, far=False)
            for cell, (row, column) in zip(around, AROUND, strict=True):
                if self._marks.state(*cell) == CellState.UNKNOWN and cell not in self._looked:
                    self._looked.add(cell)  # It looks there once: what stays unknown would hold it for good.
                    self._facing = math.atan2(row, column)
                    return None
        return self._hop(t_s)

    def _hop(self, t_s: float) -> None:
        """To the nearest explored cell by straight distance."""
        pose = self._pose.pose
        explored = [(int(row), int(column)) for row, column in self._marks.explored()]
        if not explored:
            self._end(StackStatus.ARRIVED, "no explored cell is left to visit", t_s)
            return
        open_cells = [cell for cell in explored if cell not in self._refused] or explored
        away = [
            math.hypot(x - pose.x_m, y - pose.y_m)
            for x, y in (self._marks.centre_of(row, column) for row, column in open_cells)
        ]
        cell = open_cells[int(np.argmin(away))]
        self._go(cell, far=min(away) > self._config.far_cells * min(self._marks.cell_m))

    def _go(self, cell: tuple[int, int], far: bool) -> None:
        self._goal, self._far, self._slow_periods, self._bent = cell, far, 0, False

    # --- driving ------------------------------------------------------------------------------------

    def _drive_on(self) -> WheelSpeeds:
        assert self._goal is not None
        self._slow_periods += 1  # No period of 10 ms makes 10 mm.
        pose = self._pose.pose
        x, y = self._marks.centre_of(*self._goal)
        if self._field is not None and (self._far or self._always):
            command = self._field.command(pose, x, y)
            if command is not None:
                self._bent = True
                return command
        return pursue(pose, x, y, self._drive)

    def _count_progress(self, t_s: float) -> None:
        count = self._marks.visited_count
        if count > self._new_count:
            self._new_count, self._new_at_s = count, t_s
        elif t_s - self._new_at_s > self._config.give_up_s:
            self._end(StackStatus.FAILED, "got stuck", t_s)

    def _end(self, status: StackStatus, reason: str, t_s: float) -> None:
        self._status, self._reason = status, reason
        self._goal = None
        kind = "arrived" if status is StackStatus.ARRIVED else "failed"
        self._journal.say(t_s, kind, reason)
