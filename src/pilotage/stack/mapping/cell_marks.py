"""The report's mapping: each reading marks cells, and marks of higher priority stay."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, Pose2
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.readings import InfraredReading, LineReading, Readings
from pilotage.stack.knowledge import SheetKnowledge

STEP_SHARE = 0.25
"""A beam is followed in steps of this share of a cell."""


class CellMarks:
    """Marks OBSTACLE, LINE, VISITED and EXPLORED cells (exploration report, ch. 2.1, mapping task).

    A return within a sensor's reliable range is an obstacle; what lies before it, and the reliable range
    of a sensor that sees nothing, is explored. Wrong marks of high priority stay for good: this is
    what the pose's drift does to the report's maps.
    """

    def __init__(self, knowledge: SheetKnowledge) -> None:
        columns, rows = knowledge.cells
        self._cell = knowledge.cell_m
        self._states = np.full((rows, columns), CellState.UNKNOWN, dtype=np.uint8)
        self.visited: BoolArray = np.zeros((rows, columns), dtype=np.bool_)
        self._infrared = list(knowledge.sensors_of(InfraredConfig).items())
        self._lines = list(knowledge.sensors_of(LineSensorConfig).items())
        self._edge_is_dark = knowledge.edge_is_dark

    @property
    def cells(self) -> CellMap:
        """The map with borders around obstacles."""
        return CellMap(self._states.copy()).with_borders()

    def cell_of(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """Row and column of a point; None off the sheet."""
        column, row = math.floor(x_m / self._cell[0]), math.floor(y_m / self._cell[1])
        rows, columns = self._states.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None

    def centre_of(self, row: int, column: int) -> tuple[float, float]:
        """Middle of a cell in metres."""
        return (column + 0.5) * self._cell[0], (row + 0.5) * self._cell[1]

    def step(self, readings: Readings, pose: Pose2) -> None:
        """Take in the readings of one sensing period."""
        here = self.cell_of(pose.x_m, pose.y_m)
        if here is not None:
            self.visited[here] = True
            self._mark(here, CellState.VISITED)
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        for name, config in self._infrared:
            reading = readings.by_sensor.get(name)
            if isinstance(reading, InfraredReading):
                self._beam(config, reading, pose, c, s)
        for name, sensor in self._lines:
            looked = readings.by_sensor.get(name)
            if isinstance(looked, LineReading) and looked.dark:
                mount = sensor.mount
                x = pose.x_m + c * mount.x_m - s * mount.y_m
                y = pose.y_m + s * mount.x_m + c * mount.y_m
                self._mark(self.cell_of(x, y), CellState.LINE)

    def _beam(
        self, config: InfraredConfig, reading: InfraredReading, pose: Pose2, c: float, s: float
    ) -> None:
        mount = config.mount
        x = pose.x_m + c * mount.x_m - s * mount.y_m
        y = pose.y_m + s * mount.x_m + c * mount.y_m
        theta = pose.theta_rad + mount.theta_rad
        ux, uy = math.cos(theta), math.sin(theta)
        sees = not reading.saturated and reading.range_m <= config.reliable_range_m
        length = min(reading.range_m, config.reliable_range_m)
        end = self.cell_of(x + length * ux, y + length * uy)
        step = STEP_SHARE * min(self._cell)
        for k in range(math.ceil(length / step)):
            cell = self.cell_of(x + k * step * ux, y + k * step * uy)
            if not (sees and cell == end):
                self._mark(cell, CellState.EXPLORED)
        # The stretch between the robot's middle and the sensor is under its own body.
        for k in range(math.ceil(math.hypot(mount.x_m, mount.y_m) / step)):
            share = k * step / max(math.hypot(mount.x_m, mount.y_m), step)
            cell = self.cell_of(pose.x_m + share * (x - pose.x_m), pose.y_m + share * (y - pose.y_m))
            self._mark(cell, CellState.EXPLORED)
        if sees:
            self._mark(end, CellState.OBSTACLE)

    def _mark(self, cell: tuple[int, int] | None, state: CellState) -> None:
        if cell is not None and self._states[cell] > state:
            self._states[cell] = state
