"""A quintic spline along a path over cells that keeps clear of the grid's blocked cells.

The rover report draws its spline through the path's points and never checks it. Here the curve is held
against the grid everywhere: at steps of an eightieth of a cell it has to be farther from every blocked
cell's edge than half a step, so that no point between two samples can be inside one. Where it is not, the
knots nearby are set closer along the polyline, which the curve approaches as they do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.stack.planning.quintic_spline import QuinticSpline

STEPS_A_CELL = 80
COARSE_STEPS_A_CELL = 2
ROUNDING = 1e-9
"""Cells: a straight curve that leads away from what is nearest grows as far away as it is long."""
MAX_ROUNDS = 12
"""Each halves the distance of the knots where the curve was too near."""

BESIDE = 2
"""Stretches beside one that is too near whose knots are set closer as well, so that the spacing changes
gently: a bend swings on for as many stretches."""


@dataclass(frozen=True, slots=True, eq=False)
class ClearSpline:
    """The curve, or the reason why there is none.

    Attributes
    ----------
    spline
        The curve; where it could not be kept clear, None.
    clearance_m
        Its least distance from blocked cells, at most two cells' sides; where there is no curve, that of
        the last one tried.
    rounds, knots
        How often knots were added, and how many there are.
    """

    spline: QuinticSpline | None
    reason: str
    clearance_m: float
    rounds: int
    knots: int


def path_knots(grid: OccupancyGrid, cells: IntArray, every: int = 1) -> FloatArray:
    """Knots (K, 2) for a path over cells: every so many-th cell's centre, the first and the last always.

    The report's own knots are ``grid.points_m(cells)``, the cells' top left corners (equations 5.1 and 5.2):
    right for a path, but touching the cells above and to the left, so that no curve through them is clear.
    """
    if every < 1:
        raise InputError(f"spline: expected knots on every n-th cell with n from 1, found {every}")
    last = len(cells) - 1
    return grid.centres_m(cells[np.unique(np.append(np.arange(0, last + 1, every), last))])


def clear_spline(
    knots_xy_m: FloatArray,
    grid: OccupancyGrid,
    blocked: BoolArray,
    clearance_m: float = 0.0,
    polyline_xy_m: FloatArray | None = None,
) -> ClearSpline:
    """Find a quintic spline along a polyline that stays more than ``clearance_m`` from blocked cells.

    Parameters
    ----------
    knots_xy_m
        (K, 2) the first knots, points of the polyline in its order.
    grid, blocked
        Where the cells lie, and which are blocked (with any inflation); outside the grid all is.
    clearance_m
        Less than one and a half cells' sides. A path over eight neighbours, corners not cut, has half a
        side along its centres.
    polyline_xy_m
        (P, 2) what the curve is drawn towards; the knots themselves where None.

    Raises
    ------
    InputError
        Where the clearance is out of range or the polyline does not move.
    """
    side_m = grid.resolution_m
    if not 0.0 <= clearance_m < 1.5 * side_m:
        raise InputError(
            f"spline: expected a clearance from 0 to below {1.5 * side_m:g} m, one and a half cells, found "
            f"{clearance_m:g}; inflate the grid for more"
        )
    line = _Polyline(knots_xy_m if polyline_xy_m is None else polyline_xy_m)
    at = line.lengths_of(np.asarray(knots_xy_m, dtype=np.float64).reshape(-1, 2))
    ground = _Ground(grid, np.ascontiguousarray(blocked), clearance_m)
    along = np.linspace(0.0, line.length_m, _count(line.length_m, side_m))
    least_m, where = ground.least(line.at(along))
    if least_m <= clearance_m + ground.step_m:
        reason = (
            f"the path itself comes within {least_m:.3g} m of blocked ground at "
            f"({where[0]:.6g}, {where[1]:.6g}), {clearance_m:g} m and a little more are asked for"
        )
        return ClearSpline(None, reason, least_m, 0, len(at))
    for rounds in range(MAX_ROUNDS + 1):
        spline = QuinticSpline(line.at(at))
        near_m, least_m, where = ground.too_near(spline)
        if len(near_m) == 0:
            return ClearSpline(spline, f"clear after {rounds} rounds", least_m, rounds, len(at))
        at = _denser(at, spline.knot_lengths_m(), near_m)
    reason = (
        f"after {MAX_ROUNDS} rounds of adding knots the curve still comes within {least_m:.3g} m of "
        f"blocked ground at ({where[0]:.6g}, {where[1]:.6g})"
    )
    return ClearSpline(None, reason, least_m, MAX_ROUNDS, len(at))


def _count(length_m: float, side_m: float) -> int:
    return max(2, math.ceil(length_m / side_m * STEPS_A_CELL) + 1)


def _denser(at: FloatArray, knots_m: FloatArray, near_m: FloatArray) -> FloatArray:
    """Knots with one more in the middle of every stretch near where the curve was too near."""
    stretch = np.clip(np.searchsorted(knots_m, near_m, side="right") - 1, 0, len(at) - 2)
    chosen = np.unique(np.clip(stretch[:, None] + np.arange(-BESIDE, BESIDE + 1), 0, len(at) - 2))
    return np.sort(np.append(at, 0.5 * (at[chosen] + at[chosen + 1])))


class _Polyline:
    """Straight lines through points, by length."""

    def __init__(self, points_xy_m: FloatArray) -> None:
        points = np.asarray(points_xy_m, dtype=np.float64).reshape(-1, 2)
        moved = np.ones(len(points), dtype=np.bool_)
        moved[1:] = (np.diff(points, axis=0) != 0.0).any(axis=1)
        self.points = points[moved]
        if len(self.points) < 2:
            raise InputError("spline: expected a path that moves, found a single point")
        self.s: FloatArray = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        self.length_m = float(self.s[-1])

    def at(self, s_m: FloatArray) -> FloatArray:
        return np.column_stack([np.interp(s_m, self.s, self.points[:, k]) for k in (0, 1)])

    def lengths_of(self, knots: FloatArray) -> FloatArray:
        """Where the knots lie on the line, in order; InputError for one that does not."""
        out: list[float] = []
        i = 0
        for knot in knots:
            while i < len(self.points) and not (self.points[i] == knot).all():
                i += 1
            if i == len(self.points):
                raise InputError("spline: expected knots that are points of the path, in its order")
            out.append(float(self.s[i]))
        return np.unique(out)


class _Ground:
    """Blocked cells, and how near to them a curve may come."""

    def __init__(self, grid: OccupancyGrid, blocked: BoolArray, clearance_m: float) -> None:
        self._grid, self._blocked = grid, blocked
        self._clearance = clearance_m / grid.resolution_m
        self.step_m = grid.resolution_m / STEPS_A_CELL

    def too_near(self, spline: QuinticSpline) -> tuple[FloatArray, float, FloatArray]:
        """Lengths along the curve where it is too near, the least clearance in metres, and where that is.

        First in coarse steps; fine ones only where a coarse one might hide something.
        """
        side_m = self._grid.resolution_m
        count = max(2, math.ceil(spline.length_m / side_m * COARSE_STEPS_A_CELL) + 1)
        coarse = np.linspace(0.0, spline.length_m, count)
        coarse_step_m = coarse[1] - coarse[0]
        distance = self._distances(spline.at(coarse).points_xy_m)
        # A piece whose ends are d1 and d2 away comes no nearer than (d1 + d2 - piece) / 2.
        bound = 0.5 * (distance[:-1] + distance[1:] - coarse_step_m / side_m)
        doubtful = np.flatnonzero(bound <= max(self._clearance, float(distance.min())) + ROUNDING)
        parts = max(2, math.ceil(coarse_step_m / self.step_m))
        step_m = coarse_step_m / parts
        s = (coarse[doubtful, None] + np.arange(parts + 1) * step_m).ravel()
        points = spline.at(s).points_xy_m
        fine = self._distances(points)
        least = int(np.argmin(fine))
        near = fine * side_m <= self._clearance * side_m + 0.5 * step_m
        return s[near], float(fine[least]) * side_m, points[least]

    def least(self, points: FloatArray) -> tuple[float, FloatArray]:
        distance = self._distances(points)
        least = int(np.argmin(distance))
        return float(distance[least]) * self._grid.resolution_m, points[least]

    def _distances(self, points: FloatArray) -> FloatArray:
        """In cells, up to two."""
        return distance_to_blocked(self._grid.places_at(points), self._blocked, 2)
