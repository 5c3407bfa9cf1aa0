"""The explorer that knows: a short tour through every reachable cell of the true sheet, from the true pose.

Cells side by side make runs, driven straight; the order of the runs is the nearest neighbour's, improved by
turning parts of it round (2-opt). What it takes is about what a robot with this drive needs at least; no
proof of that is offered, and one that weaves along the border of two rows could do with less.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from pilotage.core.types import STANDSTILL, BoolArray, FloatArray, IntArray, Pose2, WheelSpeeds
from pilotage.evaluation.sheet_visits import VisitedCells
from pilotage.experiments.oracles.certain import exactly
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.sensors.readings import Readings
from pilotage.stack.control.waypoint_drive import WaypointDrive
from pilotage.stack.exploration.explorer import LeftCell, offer
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.mapping.sheet_grid import SheetShape
from pilotage.stack.planning.sheet_room import Point, SheetRoom

RESOLUTION_M = 0.018
ROOM_M, WIDE_M = 0.006, 0.02
OVERHANG_M, KEEP_OFF_M = 0.0, 0.006
SPEED_SHARE, TURN_SHARE, STUCK_S = 0.96, 0.9, 6.0
TURN_M = 0.12
"""Distance that a turn at the end of a run costs: what is driven meanwhile elsewhere."""
TRIES = 3
Run = tuple[Point, ...]


class TourExplorer:
    """Drives the tour, then to whatever it passed by.

    Parameters
    ----------
    pose
        The true pose.
    wanted
        (rows, columns) cells to visit.
    """

    def __init__(
        self, knowledge: SheetKnowledge, pose: Callable[[], Pose2], wanted: BoolArray, journal: Journal
    ) -> None:
        plan = knowledge.given.plan
        assert plan is not None, "the tour is planned on the true sheet"
        self._pose, self._plan, self._wanted, self._journal = pose, plan, wanted, journal
        offer(journal, self)
        self._channel = journal.channel({"goal_x_m": "m", "goal_y_m": "m"})
        shape = SheetShape.of(knowledge.size_m, knowledge.cells, RESOLUTION_M)
        self._room = SheetRoom(shape, knowledge.body_radius_m, ROOM_M, WIDE_M)
        self._room.update(plan.walls_m, np.zeros((0, 2)))
        self._stands = self._room.stands(wanted, OVERHANG_M, KEEP_OFF_M)
        self._tries = np.zeros(wanted.shape, dtype=np.int64)
        drive = knowledge.drive
        turning = 2.0 * drive.max_wheel_speed_rad_s * drive.wheel_radius_m / drive.wheel_separation_m
        self._driver = WaypointDrive(drive, SPEED_SHARE, TURN_SHARE * turning, STUCK_S)
        self._visits = VisitedCells(knowledge.size_m, knowledge.cells)
        self._goal: tuple[int, int] | None = None
        self._status, self._reason = StackStatus.RUNNING, ""
        self._left: tuple[LeftCell, ...] = ()
        self._ahead = self._tour((knowledge.initial.pose.x_m, knowledge.initial.pose.y_m))

    @property
    def belief(self) -> Belief:
        """The true pose, almost certain."""
        return exactly(self._pose())

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived once no cell is left that it can come to."""
        return self._status, self._reason

    @property
    def cells(self) -> CellMap:
        """What stands there, and where it was."""
        known = self._plan.features.marked(np.ones_like(self._wanted), CellState.EXPLORED)
        return known.marked(self._visits.visited, CellState.VISITED)

    @property
    def visited(self) -> BoolArray:
        """Where it was."""
        return self._visits.visited

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """Cells that no path leads to."""
        return self._left

    def step(self, readings: Readings) -> WheelSpeeds:
        """Drive on; the sensors say nothing that is not known."""
        pose = self._pose()
        self._visits.add(pose.x_m, pose.y_m, readings.t_s)
        x, y = self._driver.waypoints[-1] if self._driver.waypoints else (math.nan, math.nan)
        self._channel.tell(x, y)
        if self._status is not StackStatus.RUNNING:
            return STANDSTILL
        if self._driver.is_stuck(readings.t_s):
            self._driver.stop()
        while not self._driver.waypoints:
            if not self._next((pose.x_m, pose.y_m), readings.t_s):
                return STANDSTILL
        return self._driver.step((pose.x_m, pose.y_m, pose.theta_rad), readings.t_s)

    # --- where to ------------------------------------------------------------------------------------

    def _next(self, here: Point, t_s: float) -> bool:
        """Set out on the next run, or for the nearest cell that was passed by; False: all is done."""
        if self._goal is not None and not self._visits.visited[self._goal]:
            self._tries[self._goal] += 1
        self._goal = None
        cost, parent = self._room.costs(*here)
        while self._ahead:
            run = self._ahead.pop(0)
            path = self._path(run, here, cost, parent)
            if path:
                self._driver.follow(path, t_s, slow_at_end=False)
                return True
        missed = np.argwhere(self._wanted & ~self._visits.visited & (self._tries < TRIES))
        reached = [
            (float(cost[node]), (int(row), int(column)), node)
            for row, column in missed
            if (node := self._room.entry(cost, *self._stands[row, column, :2].tolist())) >= 0
        ]
        if reached:
            _, self._goal, node = min(reached)
            x, y = self._stands[self._goal][:2].tolist()
            self._driver.follow(self._room.path(parent, node, here, (x, y)), t_s, slow_at_end=True)
            return True
        unseen = np.argwhere(self._wanted & ~self._visits.visited).tolist()
        self._left = tuple(LeftCell(row, column, "unreachable") for row, column in unseen)
        self._status = StackStatus.ARRIVED
        self._reason = f"done: {self._visits.count} cells visited, {len(unseen)} left"
        self._journal.say(t_s, "arrived", self._reason)
        return False

    def _path(self, run: Run, here: Point, cost: FloatArray, parent: IntArray) -> list[Point]:
        """Along a run from its first point; straight there where nothing stands between."""
        if self._room.clear(here, run[0]) >= ROOM_M:
            return list(run)
        node = self._room.entry(cost, *run[0])
        return [] if node < 0 else [*self._room.path(parent, node, here, run[0]), *run[1:]]

    def _tour(self, start: Point) -> list[Run]:
        """The shorter of the tours along rows and along columns."""
        tours = [self._ordered(runs, start) for runs in (self._runs(False), self._runs(True))]
        _, best = min(tours, key=lambda tour: tour[0])
        return best

    def _runs(self, upright: bool) -> list[Run]:
        """Straight pieces through neighbouring cells of a row, or of a column."""
        reachable = self._wanted & (self._stands[:, :, 2] > 0.0)
        lanes = reachable.T if upright else reachable
        runs: list[Run] = []
        for lane, marks in enumerate(lanes):
            points: list[Point] = []
            last = -2
            for place in np.flatnonzero(marks).tolist():
                point = self._point(*((place, lane) if upright else (lane, place)))
                if points and (place != last + 1 or self._room.clear(points[-1], point) < ROOM_M):
                    runs.append(_corners(points))
                    points = []
                points.append(point)
                last = place
            if points:
                runs.append(_corners(points))
        return runs

    def _point(self, row: int, column: int) -> Point:
        """Where to pass through a cell: its middle where there is room, else where there is most."""
        shape = self._room.shape
        middle = (column + 0.5) * shape.cell_width_m, (row + 0.5) * shape.cell_height_m
        width, height = shape.size_m
        inside = min(middle[0], width - middle[0], middle[1], height - middle[1])
        if inside >= self._room.body_m and self._room.at(*middle) >= ROOM_M:
            return middle
        x, y = self._stands[row, column, :2].tolist()
        return x, y

    def _ordered(self, runs: Sequence[Run], start: Point) -> tuple[float, list[Run]]:
        """The runs in a good order and direction, and the length all in all."""
        if not runs:
            return 0.0, []
        ends = [point for run in runs for point in (run[0], run[-1])]
        between = np.array([[start, *ends]]).reshape(-1, 2)
        away = np.array([self._away(point, between) for point in between])
        away = 0.5 * (away + away.T)
        inner = sum(_length(run) for run in runs)
        order = _two_opt(_nearest_first(away), away)
        return (
            inner + _cost(order, away),
            [runs[k // 2] if k % 2 == 0 else runs[k // 2][::-1] for k in order],
        )

    def _away(self, start: FloatArray, ends: FloatArray) -> FloatArray:
        """(E,) distance from a point to others; far beyond all where there is none."""
        cost, _ = self._room.costs(*start.tolist())
        nodes = [self._room.entry(cost, *end) for end in ends.tolist()]
        away = np.array([cost[node] if node >= 0 else math.inf for node in nodes])
        return np.where(np.isfinite(away), away + TURN_M, 1e3)


def _corners(points: Sequence[Point]) -> Run:
    """The points at which the direction changes, and both ends."""
    kept = [points[0]]
    for before, point, after in zip(points, points[1:], points[2:], strict=False):
        bend = (point[0] - before[0]) * (after[1] - point[1]) - (point[1] - before[1]) * (after[0] - point[0])
        if abs(bend) > 1e-9:
            kept.append(point)
    return (*kept, points[-1]) if len(points) > 1 else (points[0],)


def _length(run: Run) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(run))


def _cost(order: Sequence[int], away: FloatArray) -> float:
    """Distance between the runs: entry k of the order begins at its end k and ends at the other, k ^ 1."""
    total, at = 0.0, 0
    for k in order:
        total += float(away[at, k + 1])
        at = (k ^ 1) + 1
    return total


def _nearest_first(away: FloatArray) -> list[int]:
    """Always the nearest end of a run not yet driven."""
    order: list[int] = []
    open_ends, at = set(range(away.shape[0] - 1)), 0
    while open_ends:
        k = min(open_ends, key=lambda end: (float(away[at, end + 1]), end))
        order.append(k)
        open_ends -= {k, k ^ 1}
        at = (k ^ 1) + 1
    return order


def _two_opt(order: list[int], away: FloatArray) -> list[int]:
    """Turn parts of the order round, runs and all, while that is shorter; paths there and back are alike."""
    improved = True
    while improved:
        improved = False
        for i in range(len(order)):
            came = (order[i - 1] ^ 1) + 1 if i else 0
            for j in range(i, len(order)):
                first, last = order[i] + 1, (order[j] ^ 1) + 1
                gain = away[came, first] - away[came, last]
                if j + 1 < len(order):
                    after = order[j + 1] + 1
                    gain += away[last, after] - away[first, after]
                if gain > 1e-9:
                    order[i : j + 1] = [k ^ 1 for k in reversed(order[i : j + 1])]
                    improved = True
    return order
