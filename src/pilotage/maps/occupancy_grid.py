"""Occupancy grids: square cells that are free, occupied, something between, or unknown.

**Rows and columns.** Row 0 is the top row, as images, MovingAI files and elevation models have it: its
cells have the largest y of the grid's own frame, and y falls as the row grows. Column 0 has the smallest
x. The grid's own frame sits in the outer lower-left corner of the lower-left cell, which is what ``origin``
places in the map frame (as ROS map files do). Nothing else in pilotage states this again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.kernels.grids import distance as grid_distance
from pilotage.maps.memory import require_memory

OccupancyArray = NDArray[np.int8]

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""As in ROS's ``nav_msgs/OccupancyGrid``: per cent, and -1."""

OCCUPIED_FROM = 65
"""Occupancy in per cent from which a cell counts as blocked."""

CORNER = Pose2(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """A grid map.

    Attributes
    ----------
    cells
        (rows, columns) int8 in per cent: 0 free to 100 occupied, -1 unknown; read-only.
    resolution_m
        Side of a cell.
    origin
        Pose of the lower-left cell's outer corner in the map frame; its heading turns the whole grid.
    """

    cells: OccupancyArray
    resolution_m: float
    origin: Pose2 = CORNER

    def __post_init__(self) -> None:
        cells = self.cells
        if cells.ndim != 2 or cells.size == 0:
            raise InputError(
                f"grid: expected cells in rows and columns, found an array of shape {cells.shape}"
            )
        if cells.dtype != np.int8:
            raise InputError(f"grid: expected cells of type int8, found {cells.dtype}; use OccupancyGrid.of")
        if cells.min() < UNKNOWN or cells.max() > OCCUPIED:
            raise InputError(f"grid: expected cells from -1 to 100, found {cells.min()} to {cells.max()}")
        if not (math.isfinite(self.resolution_m) and self.resolution_m > 0.0):
            raise InputError(f"grid: expected a resolution above 0 m, found {self.resolution_m}")
        if not all(math.isfinite(value) for value in self.origin.as_array()):
            raise InputError(f"grid: expected a finite origin, found {self.origin}")
        if cells.flags.writeable or not cells.flags.c_contiguous:
            cells = cells.copy()
            cells.flags.writeable = False
            object.__setattr__(self, "cells", cells)

    def in_blocks(self, step: int) -> OccupancyGrid:
        """The same with ``step`` by ``step`` cells made one: occupied where one is, unknown where all are.

        Whole blocks from the origin on: it may reach beyond the grid at the top and the right.
        """
        if step <= 1:
            return self
        rows, columns = math.ceil(self.rows / step), math.ceil(self.columns / step)
        padded = np.full((rows * step, columns * step), UNKNOWN, dtype=np.int8)
        padded[rows * step - self.rows :, : self.columns] = self.cells
        blocks = padded.reshape(rows, step, columns, step)
        cells = np.where((blocks == UNKNOWN).all(axis=(1, 3)), np.int8(UNKNOWN), np.int8(FREE))
        cells[(blocks >= OCCUPIED_FROM).any(axis=(1, 3))] = OCCUPIED
        return OccupancyGrid(cells, self.resolution_m * step, self.origin)

    def known_part(self, step: int = 1) -> OccupancyGrid:
        """The least of it with all that is known, and one cell of what is not on each side that has it.

        All of it where nothing is known. It begins a whole number of ``step`` cells from the origin.
        """
        sides = []
        for axis, size in ((1, self.rows), (0, self.columns)):
            known = np.flatnonzero((self.cells != UNKNOWN).any(axis=axis))
            if not len(known):
                return self
            sides.append((max(int(known[0]) - 1, 0), min(int(known[-1]) + 2, size)))
        (top, bottom), (left, right) = sides
        bottom, left = bottom + (self.rows - bottom) % step, left - left % step
        if (top, bottom, left, right) == (0, self.rows, 0, self.columns):
            return self
        x_m, y_m = self.points_m(np.array([[bottom, left]]))[0].tolist()
        origin = Pose2(x_m, y_m, self.origin.theta_rad)
        return OccupancyGrid(self.cells[top:bottom, left:right], self.resolution_m, origin)

    @staticmethod
    def of(values: ArrayLike, resolution_m: float, origin: Pose2 = CORNER) -> OccupancyGrid:
        """Build from an array: booleans (True is occupied), per cent with -1, or probabilities.

        Whole numbers are per cent; floats are probabilities from 0 to 1, NaN for unknown.
        """
        array = np.asarray(values)
        if array.dtype == np.bool_:
            return OccupancyGrid(array.view(np.int8) * np.int8(OCCUPIED), resolution_m, origin)
        if array.dtype.kind == "f":
            known = np.isfinite(array)
            if ((array < 0.0) | (array > 1.0)).any():
                raise InputError("grid: expected probabilities from 0 to 1, found others")
            per_cent = np.rint(np.where(known, array, 0.0) * 100.0)
            return OccupancyGrid(np.where(known, per_cent, UNKNOWN).astype(np.int8), resolution_m, origin)
        if array.dtype.kind not in "iu":
            raise InputError(f"grid: expected booleans or numbers, found {array.dtype}")
        if array.size and (int(array.min()) < UNKNOWN or int(array.max()) > OCCUPIED):
            raise InputError(f"grid: expected cells from -1 to 100, found {array.min()} to {array.max()}")
        return OccupancyGrid(array.astype(np.int8), resolution_m, origin)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.cells.shape[0])

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.cells.shape[1])

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height in the grid's own frame."""
        return self.columns * self.resolution_m, self.rows * self.resolution_m

    @property
    def frame(self) -> FloatArray:
        """(5,) as kernels have it: x, y, cosine and sine of the lower left corner's pose, a cell's side."""
        theta = self.origin.theta_rad
        return np.array(
            [self.origin.x_m, self.origin.y_m, math.cos(theta), math.sin(theta), self.resolution_m]
        )

    def blocked(self, occupied_from: int = OCCUPIED_FROM, unknown_is_free: bool = False) -> BoolArray:
        """(rows, columns) whether a cell is an obstacle."""
        if unknown_is_free:
            return np.asarray(self.cells >= occupied_from)
        # Unsigned, unknown is 255 and so above any per cent: one pass and one array for both questions.
        return np.asarray(self.cells.view(np.uint8) >= max(0, occupied_from))

    def contains(self, row: int, column: int) -> bool:
        """Whether there is such a cell."""
        return 0 <= row < self.rows and 0 <= column < self.columns

    def places_at(self, points_xy_m: FloatArray) -> FloatArray:
        """Places (K, 2) of points (K, 2) in rows and columns, counted from the top left corner.

        Cell (r, c) is the square from (r, c) to (r + 1, c + 1).
        """
        points = np.asarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        x, y = points[:, 0] - self.origin.x_m, points[:, 1] - self.origin.y_m
        if self.origin.theta_rad != 0.0:
            c, s = math.cos(self.origin.theta_rad), math.sin(self.origin.theta_rad)
            x, y = c * x + s * y, c * y - s * x
        height = self.rows * self.resolution_m
        return np.stack([(height - y) / self.resolution_m, x / self.resolution_m], axis=1)

    def cells_at(self, points_xy_m: FloatArray) -> IntArray:
        """Row and column (K, 2) of the cells that points (K, 2) lie in; outside the grid as they come.

        With origin (0, -10) and 10 m cells these are equations 3.1 and 3.2 of the rover report.
        """
        # Far beyond the grid is outside as well, without leaving the range of whole numbers.
        with np.errstate(over="ignore", invalid="ignore"):
            places = self.places_at(points_xy_m)
        # The greater number is the other one where a place is NaN.
        return np.floor(np.minimum(np.fmax(places, -1.0), 2.0**40)).astype(np.int64)

    def cell_at(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Row and column of the cell that a point lies in; outside the grid as they come."""
        row, column = self.cells_at(np.array([[x_m, y_m]]))[0]
        return int(row), int(column)

    def points_m(self, places: IntArray | FloatArray) -> FloatArray:
        """Points (K, 2) x, y in the map frame of places (K, 2) in rows and columns; undoes ``places_at``.

        Of whole rows and columns these are the cells' top left corners, as the rover report has it in
        equations 5.1 and 5.2 (origin (0, -10), 10 m cells).
        """
        at = np.asarray(places, dtype=np.float64).reshape(-1, 2)
        x = at[:, 1] * self.resolution_m
        y = (self.rows - at[:, 0]) * self.resolution_m
        c, s = math.cos(self.origin.theta_rad), math.sin(self.origin.theta_rad)
        return np.stack([self.origin.x_m + c * x - s * y, self.origin.y_m + s * x + c * y], axis=1)

    def centres_m(self, cells: IntArray | FloatArray) -> FloatArray:
        """Centres (K, 2) x, y in the map frame of cells (K, 2) row, column."""
        return self.points_m(np.asarray(cells, dtype=np.float64).reshape(-1, 2) + 0.5)


def squared_distances(blocked: BoolArray) -> NDArray[np.uint32]:
    """(rows, columns) exact squared distance in cells, centre to centre, to the nearest blocked cell.

    Raises
    ------
    InputError
        For grids of more than 32,767 cells a side, and where memory does not suffice.
    """
    if max(blocked.shape) >= grid_distance.FAR:
        raise InputError(
            f"grid: expected at most {grid_distance.FAR - 1} cells a side for distances, "
            f"found {blocked.shape}"
        )
    require_memory(4 * blocked.size, "distances on the grid")
    return grid_distance.squared_distance(np.ascontiguousarray(blocked))


def near_blocked(blocked: BoolArray, radius_cells: float) -> BoolArray:
    """(rows, columns) whether a cell is blocked or its centre nearer than a radius to a blocked one's."""
    if radius_cells <= 1.0 or not blocked.any():
        return blocked.copy()
    # Distances are whole when squared, so the comparison is exact: 5 cells away is not nearer than 5.
    near: BoolArray = squared_distances(blocked) < radius_cells * radius_cells * (1.0 - 1e-12)
    return near
