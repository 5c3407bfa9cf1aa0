"""The report's explorer: look north, south, east and west; else hop to the nearest explored cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import STANDSTILL, BoolArray, Event, WheelSpeeds
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.potential_field import PotentialField
from pilotage.stack.control.wheel_pursuit import pursue, turn
from pilotage.stack.exploration.explorer import EXPLORERS, LeftCell
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.localization.wheel_pose import WheelPose
from pilotage.stack.mapping.cell_marks import CellMarks

AROUND = ((1, 0), (-1, 0), (0, 1), (0, -1))
"""North, south, east, west, in the report's order: (rows, columns)."""
FACING_RAD = 0.1


class SurroundCheckConfig(Config):
    """The report's numbers; ``avoid`` says when the potential field acts where the mission switches it on."""

    goal_tolerance_m: Positive = 0.020
    planning_period_s: Positive = 0.1
    sensing_period_s: Positive = 0.05
    stuck_periods: int = Field(default=200, ge=1)
    """A goal is dropped after so many control periods with less than 10 mm of progress each: after 2 s."""
    far_cells: Positive = 1.5
    """A hop is far where its goal lies more cells away than this."""
    avoid: Literal["far-hops", "always"] = "far-hops"
    give_up_s: Positive = 60.0
    """Stuck where no cell was new for so long."""


@EXPLORERS.add("surround-check", SurroundCheckConfig)
class SurroundCheck:
    """Next cell by the states around (exploration report, ch. 2.1): explored first, unknown as a heading.

    Where none of the four is either, it hops to the nearest explored cell by straight distance, whatever
    stands between. With ``avoid: always`` the potential field also acts on the next cell, but never
    against it: a cell that it cannot enter is dropped, so that the explorer is not blocked.
    Fails by its pose, and where the nearest explored cell is behind a box.
    """

    def __init__(self, config: SurroundCheckConfig, knowledge: SheetKnowledge) -> None:
        self._config = config
        self._drive = knowledge.drive
        self._dt_s = knowledge.dt_s
        self._plan_every = max(1, round(config.planning_period_s / knowledge.dt_s))
        self._pose = WheelPose(knowledge)
        self._marks = CellMarks(knowledge)
        infrared = knowledge.sensors_of(InfraredConfig)
        self._field = PotentialField(infrared, knowledge.drive) if knowledge.avoidance else None
        self._goal: tuple[int, int] | None = None
        self._facing: float | None = None
        self._far = False
        self._slow_periods = 0
        self._refused: set[tuple[int, int]] = set()
        self._steps = 0
        self._new_at_s, self._new_count = 0.0, 0
        self._status, self._reason = StackStatus.RUNNING, ""
        self._events: list[Event] = []

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
        self._steps += 1
        pose = self._pose.step(readings).pose
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

    def telemetry(self) -> Mapping[str, float]:
        """The goal and whether it is a far one."""
        x, y = (math.nan, math.nan) if self._goal is None else self._marks.centre_of(*self._goal)
        return {"goal_x_m": x, "goal_y_m": y, "far_hop": float(self._far)}

    def drain_events(self) -> list[Event]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events

    # --- choosing -----------------------------------------------------------------------------------

    def _plan(self, t_s: float) -> None:
        """Choose the next cell once the last one was reached or dropped."""
        pose = self._pose.belief.pose
        if self._goal is not None:
            x, y = self._marks.centre_of(*self._goal)
            if math.hypot(x - pose.x_m, y - pose.y_m) <= self._config.goal_tolerance_m:
                self._goal = None
            elif self._states()[self._goal] <= CellState.BORDER:
                self._goal = None  # It has turned out to be no place to go to.
            elif self._slow_periods >= self._config.stuck_periods:
                self._refused.add(self._goal)
                self._goal = None
        if self._goal is None and self._facing is None:
            self._choose(t_s)

    def _choose(self, t_s: float) -> None:
        pose = self._pose.belief.pose
        here = self._marks.cell_of(pose.x_m, pose.y_m)
        states = self._states()
        if here is not None:
            for row, column in AROUND:
                cell = (here[0] + row, here[1] + column)
                if not (0 <= cell[0] < states.shape[0] and 0 <= cell[1] < states.shape[1]):
                    continue
                if states[cell] == CellState.EXPLORED and cell not in self._refused:
                    return self._go(cell, far=False)
                if states[cell] == CellState.UNKNOWN and cell not in self._refused:
                    self._refused.add(cell)  # It looks there once.
                    self._facing = math.atan2(row, column)
                    return None
        return self._hop(states, t_s)

    def _hop(self, states: np.ndarray[tuple[int, int], np.dtype[np.uint8]], t_s: float) -> None:
        """To the nearest explored cell by straight distance."""
        pose = self._pose.belief.pose
        explored = np.argwhere(states == CellState.EXPLORED)
        if not len(explored):
            self._end(StackStatus.ARRIVED, "no explored cell is left to visit", t_s)
            return
        open_cells = [
            tuple(map(int, cell)) for cell in explored if tuple(map(int, cell)) not in self._refused
        ]
        if not open_cells:
            # The firmware knows no refusals: it tries them all again.
            self._refused.clear()
            open_cells = [tuple(map(int, cell)) for cell in explored]
        away = [
            math.hypot(x - pose.x_m, y - pose.y_m)
            for x, y in (self._marks.centre_of(row, column) for row, column in open_cells)
        ]
        row, column = open_cells[int(np.argmin(away))]
        cell_m = min(self._marks.centre_of(1, 1)[0] - self._marks.centre_of(0, 0)[0], 1.0)
        self._go((row, column), far=min(away) > self._config.far_cells * cell_m)

    def _go(self, cell: tuple[int, int], far: bool) -> None:
        self._goal, self._far, self._slow_periods = cell, far, 0

    def _states(self) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
        return self._marks.cells.states

    # --- driving ------------------------------------------------------------------------------------

    def _drive_on(self) -> WheelSpeeds:
        assert self._goal is not None
        self._slow_periods += 1  # No period of 10 ms makes 10 mm.
        pose = self._pose.belief.pose
        x, y = self._marks.centre_of(*self._goal)
        if self._field is not None and (self._far or self._config.avoid == "always"):
            command = self._field.command(pose, x, y)
            if command is not None:
                return command
        return pursue(pose, x, y, self._drive)

    def _count_progress(self, t_s: float) -> None:
        count = int(self._marks.visited.sum())
        if count > self._new_count:
            self._new_count, self._new_at_s = count, t_s
        elif t_s - self._new_at_s > self._config.give_up_s:
            self._end(StackStatus.FAILED, "got stuck", t_s)

    def _end(self, status: StackStatus, reason: str, t_s: float) -> None:
        self._status, self._reason = status, reason
        self._goal = None
        kind = "arrived" if status is StackStatus.ARRIVED else "failed"
        self._events.append(Event(t_s, kind, reason))
