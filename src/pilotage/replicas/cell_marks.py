"""The report's mapping: each reading marks cells, and marks of higher priority stay."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, IntArray, Pose2
from pilotage.kernels.sheet import cell_beam
from pilotage.maps.cell_map import FEATURES, CellMap, CellState
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.readings import InfraredReading, LineReading, Readings
from pilotage.stack.knowledge import FloorPlan, SheetKnowledge

STEP_SHARE = 0.25
"""A beam is followed in steps of this share of a cell."""


class CellMarks:
    """Marks OBSTACLE, LINE, VISITED and EXPLORED cells (exploration report, ch. 2.1, mapping task).

    A return within a sensor's reliable range is an obstacle; what lies before it, and the reliable range
    of a sensor that sees nothing, is explored. Features are marked anywhere, everything else keeps
    ``margin_cells`` away from the map's edge. Wrong marks of high priority stay for good: this is what the
    pose's drift does to the report's maps. With a floor plan there is nothing to find out: what it draws
    stands from the start, the rest is explored, and only visits are marked.
    """

    def __init__(self, knowledge: SheetKnowledge, margin_cells: int = 0) -> None:
        columns, rows = knowledge.cells
        self._margin = margin_cells
        self._line_at_centre = knowledge.firmware.lines_at_centre
        self.cell_m = knowledge.cell_m
        self._states = np.full((rows, columns), CellState.UNKNOWN, dtype=np.uint8)
        self.visited: BoolArray = np.zeros((rows, columns), dtype=np.bool_)
        self.visited_count = 0
        self._infrared = list(knowledge.sensors_of(InfraredConfig).items())
        self._lines = list(knowledge.sensors_of(LineSensorConfig).items())
        if knowledge.given.plan is not None:
            self._take(knowledge.given.plan)

    @property
    def cells(self) -> CellMap:
        """The map with borders around obstacles."""
        return CellMap(self._states.copy())

    def state(self, row: int, column: int) -> CellState:
        """What is known of a cell; the margin and what lies beyond the sheet are a border."""
        rows, columns = self._states.shape
        low = self._margin
        if not (low <= row < rows - low and low <= column < columns - low):
            return CellState.BORDER
        return CellState(int(self._states[row, column]))

    def explored(self) -> IntArray:
        """(N, 2) rows and columns of the explored cells."""
        return np.argwhere(self._states == CellState.EXPLORED)

    def cell_of(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """Row and column of a point; None off the sheet."""
        column, row = math.floor(x_m / self.cell_m[0]), math.floor(y_m / self.cell_m[1])
        rows, columns = self._states.shape
        return (row, column) if 0 <= row < rows and 0 <= column < columns else None

    def centre_of(self, row: int, column: int) -> tuple[float, float]:
        """Middle of a cell in metres."""
        return (column + 0.5) * self.cell_m[0], (row + 0.5) * self.cell_m[1]

    def step(self, readings: Readings, pose: Pose2) -> None:
        """Take in the readings of one sensing period."""
        here = self.cell_of(pose.x_m, pose.y_m)
        if here is not None:
            if not self.visited[here]:
                self.visited[here] = True
                self.visited_count += 1
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
                self._mark(here if self._line_at_centre else self.cell_of(x, y), CellState.LINE)

    def _take(self, plan: FloorPlan) -> None:
        """Draw a floor plan, and look at nothing any more."""
        rows, columns = self._states.shape
        inner = np.s_[self._margin : rows - self._margin, self._margin : columns - self._margin]
        self._states[inner] = CellState.EXPLORED
        known = plan.features.with_borders().states
        self._states[inner] = np.minimum(self._states, known)[inner]
        features = plan.features.holds(*FEATURES)
        self._states[features] = plan.features.states[features]
        self._infrared, self._lines = [], []

    def _beam(
        self, config: InfraredConfig, reading: InfraredReading, pose: Pose2, c: float, s: float
    ) -> None:
        mount = config.mount
        x = pose.x_m + c * mount.x_m - s * mount.y_m
        y = pose.y_m + s * mount.x_m + c * mount.y_m
        cell_beam.mark_beam(
            self._states,
            pose.x_m,
            pose.y_m,
            x,
            y,
            pose.theta_rad + mount.theta_rad,
            min(reading.range_m, config.reliable_range_m),
            not reading.saturated and reading.range_m <= config.reliable_range_m,
            self.cell_m[0],
            self.cell_m[1],
            STEP_SHARE * min(self.cell_m),
            self._margin,
        )

    def _mark(self, cell: tuple[int, int] | None, state: CellState) -> None:
        if cell is not None:
            cell_beam.mark(self._states, cell[0], cell[1], np.uint8(state), self._margin)
