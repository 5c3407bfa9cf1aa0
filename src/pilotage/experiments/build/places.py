"""The places of a mission: checked, and those that the seed draws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.experiments.build.robots import footprint_of
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import SNAP_M, Floor
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.occupancy_grid import UNKNOWN
from pilotage.maps.outside import outside_building
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import Kidnap, PoseConfig
from pilotage.missions.robot import RobotConfig
from pilotage.models.footprint import Footprint

GRID_M = 0.1
_FIELDS: OncePerMap[DistanceField] = OncePerMap()
DRAWS_AT_ONCE = 1000
MAX_DRAWS = 100_000
ROOM_M = 0.1
"""Of a starting place that is drawn, beyond the body,"""
EASY_M, STEP_M = 0.1, 0.15
"""and of the passages from it to the others besides, where there are such: a planner's nodes lie apart, and a
gap between them that the body just fits through may have none. A place so near to that floor is of it."""


def start_pose(mission: Mission, index: int, chart: WorldMap) -> PoseConfig:
    """Where a robot is put down: the mission's start, else the sheet's, else the middle of a sheet.

    Raises
    ------
    InputError
        Where neither the mission nor its map says.
    """
    start = mission.start_of(mission.members[index])
    if start is not None:
        return start
    sheet = None if chart.markings is None else chart.markings.source
    if sheet is None:
        strategy, size = mission.team.strategy, mission.team.size
        hint = "" if strategy is None or size is not None else "; a team's are drawn where team.size is given"
        raise InputError(f"world.start: expected a start pose, found none{hint}")
    if sheet.start_pose is None:
        return PoseConfig(x_m=0.5 * sheet.size_m[0], y_m=0.5 * sheet.size_m[1])
    x, y, theta = sheet.start_pose
    if not all(map(math.isfinite, sheet.start_pose)):
        raise InputError(f"sheet: start_pose: expected finite numbers, found {sheet.start_pose}")
    return PoseConfig(x_m=x, y_m=y, theta_rad=wrap_to_pi(theta))


def settle_places(mission: Mission, chart: WorldMap, about: tuple[float, float] | None = None) -> Mission:
    """Return the mission with all its places known, so that it can be recorded and run again as it is.

    A random start without ``world.start`` is drawn on the largest floor. A team's starts are drawn on the
    floor of the place that the task is ``about``, if it is about one.
    """
    if mission.team.size is not None:
        mission = _with_drawn_starts(mission, chart, about)
    world = mission.world
    streams = RandomStreams(mission.run.seed)
    if world.random_start is None:
        starts = [start_pose(mission, index, chart) for index in range(len(mission.members))]
        if all(kidnap.to is not None for kidnap in world.kidnaps):
            return mission if mission.robots or world.start is not None else _started(mission, starts)
        given: list[PoseConfig | None] = [*starts]
    else:
        rng, clearance_m = streams.stream("start"), world.random_start.clearance_m
        given = [
            mission.start_of(robot) if chart.markings is None else start_pose(mission, index, chart)
            for index, robot in enumerate(mission.members)
        ]
        starts = [random_pose(chart, start, clearance_m, rng) for start in given]
    rng = streams.stream("kidnap")
    kidnaps = tuple(
        kidnap if kidnap.to is not None else _carried(kidnap, chart, given[kidnap.robot], rng)
        for kidnap in world.kidnaps
    )
    settled = world.model_copy(update={"random_start": None, "kidnaps": kidnaps})
    return _started(mission.model_copy(update={"world": settled}), starts)


def _started(mission: Mission, starts: Sequence[PoseConfig]) -> Mission:
    """The mission with its starts where they belong: the one robot's in the world, else each robot's own."""
    if not mission.robots and mission.robot.start is None:
        return mission.model_copy(update={"world": mission.world.model_copy(update={"start": starts[0]})})
    if not mission.robots:
        return mission.model_copy(update={"robot": mission.robot.model_copy(update={"start": starts[0]})})
    robots = tuple(
        robot.model_copy(update={"start": start}) for robot, start in zip(mission.robots, starts, strict=True)
    )
    return mission.model_copy(update={"robots": robots})


def _with_drawn_starts(mission: Mission, chart: WorldMap, about: tuple[float, float] | None) -> Mission:
    """The mission with a place for every robot that has none: drawn in turn, apart from those before.

    They are places that ``world.start`` is connected to, or what the task is about, or on the largest floor.

    Raises
    ------
    InputError
        Where the floor has no room for so many.
    """
    rng = RandomStreams(mission.run.seed).stream("starts")
    near = mission.world.start
    radii_m = [footprint_of(robot, f"robots.{k}").radius_m for k, robot in enumerate(mission.robots)]
    placed: list[tuple[PoseConfig, float]] = [
        (robot.start, radius_m)
        for robot, radius_m in zip(mission.robots, radii_m, strict=True)
        if robot.start is not None
    ]
    robots: list[RobotConfig] = []
    floors: dict[float, OpenFloor] = {}
    full: set[float] = set()
    for index, robot in enumerate(mission.robots):
        start = robot.start
        if start is None:
            clear_m = radii_m[index] + ROOM_M
            # Bodies stand apart however little is asked for.
            apart = [(place, max(mission.team.spacing_m, clear_m + radius_m)) for place, radius_m in placed]
            if clear_m not in floors:
                floors[clear_m] = OpenFloor(chart, clear_m, near, about)
            floor = floors[clear_m]
            if clear_m not in full:
                start = floor.draw(rng, apart, floor.easy)
            if start is None:
                full.add(clear_m)
                start = floor.draw(rng, apart, floor.in_cells(placed[0][0] if placed else None))
            if start is None and not placed:
                raise InputError(
                    f"robot.footprint: expected a starting place {clear_m:.2f} m from walls on "
                    f"'{chart.name}', found none; take a smaller robot or a larger map"
                )
            if start is None:
                farthest_m = max(spacing_m for _, spacing_m in apart)
                less = "less team.spacing_m" if farthest_m <= mission.team.spacing_m else "smaller robots"
                raise InputError(
                    f"team.size: expected at most {index}, for whom starting places {farthest_m:g} m apart "
                    f"were found on '{chart.name}', found {len(mission.robots)}; ask for fewer, or for {less}"
                )
            placed.append((start, radii_m[index]))
        robots.append(robot.model_copy(update={"start": start}))
    return mission.model_copy(update={"robots": tuple(robots)})


def check_place(where: str, x_m: float, y_m: float, footprint: Footprint, chart: WorldMap) -> None:
    """Refuse a place beside the map, or one that leaves no room for the body.

    A polygon needs the room of the largest disc inside it: how it stands is another question.

    Raises
    ------
    InputError
        With what was found there.
    """
    xmin, ymin, xmax, ymax = chart.bounds_m
    if not chart.contains(x_m, y_m):
        raise InputError(
            f"{where}: expected a place on the map '{chart.name}' ({xmin:g} to {xmax:g}, "
            f"{ymin:g} to {ymax:g} m), found ({x_m:g}, {y_m:g})"
        )
    _check_free(where, x_m, y_m, chart)
    needed = footprint.inner_radius_m
    clear = room_m(chart, x_m, y_m, needed)
    if clear < needed:
        what = "the body's radius" if footprint.is_disc else "the body's inner radius"
        nearest = "hazard" if chart.open_ground else "wall"
        raise InputError(
            f"{where}: expected at least {what} of {needed:g} m to the nearest {nearest}, "
            f"found {clear:.3f} m at ({x_m:g}, {y_m:g}); move it or make the body smaller"
        )


def _check_free(where: str, x_m: float, y_m: float, chart: WorldMap) -> None:
    """Refuse a place in a cell that is none to drive on, and say what cell that is."""
    grid = chart.grid
    if grid is None or chart.geometry is not None:
        return
    row, column = grid.cell_at(x_m, y_m)
    if not grid.contains(row, column) or not grid.blocked()[row, column]:
        return
    solid = "a hazard" if chart.open_ground else "an occupied cell"
    found = "an unknown cell" if grid.cells[row, column] == UNKNOWN else solid
    remedy = "move it"
    if grid.blocked().all():
        remedy = (
            "no cell of the map is free: check negate, mode and thresholds of its file, or its slope limit"
        )
    raise InputError(f"{where}: expected a free cell, found {found} at ({x_m:g}, {y_m:g}); {remedy}")


def room_m(chart: WorldMap, x_m: float, y_m: float, asked_m: float) -> float:
    """Distance from a point to the nearest wall or blocked cell; beyond ``asked_m`` it may be told short."""
    if chart.geometry is not None:
        return chart.geometry.distance_m(x_m, y_m)
    if chart.grid is None:
        return math.inf
    grid = chart.grid
    reach = math.ceil(asked_m / grid.resolution_m) + 2
    places = grid.places_at(np.array([[x_m, y_m]]))
    return float(distance_to_blocked(places, grid.blocked(), reach)[0]) * grid.resolution_m


def pose_of(place: PoseConfig) -> Pose2:
    """The pose that a mission file says."""
    return Pose2(place.x_m, place.y_m, wrap_to_pi(place.theta_rad))


def _carried(kidnap: Kidnap, chart: WorldMap, near: PoseConfig | None, rng: np.random.Generator) -> Kidnap:
    return kidnap.model_copy(update={"to": random_pose(chart, near, kidnap.clearance_m, rng)})


def random_pose(
    chart: WorldMap, reachable_from: PoseConfig | None, clearance_m: float, rng: np.random.Generator
) -> PoseConfig:
    """Draw a pose, uniform over the floor that is connected to a place at a clearance, or the largest one.

    Raises
    ------
    InputError
        Where the place itself has less clearance, or nothing is found.
    """
    found = OpenFloor(chart, clearance_m, reachable_from).draw(rng)
    if found is None:
        raise InputError(f"random place: found none with {clearance_m:g} m of clearance; ask for less")
    return found


class OpenFloor:
    """The floor that is connected to a place at a clearance; without a place the largest one of the building.

    Parameters
    ----------
    about
        Without a place: the floor nearest to this one, which may be beside a wall or in one. Whether anybody
        can get there its task tells, in its own words.

    Raises
    ------
    InputError
        Where the place itself has less clearance.
    """

    def __init__(
        self,
        chart: WorldMap,
        clearance_m: float,
        reachable_from: PoseConfig | None,
        about: tuple[float, float] | None = None,
    ) -> None:
        self._chart, self._clearance_m = chart, clearance_m
        self._field = chart.field if chart.geometry is None else _finer_field(chart)
        self._regions, count = scipy.ndimage.label(self._field.distance_m >= clearance_m)
        if reachable_from is None:
            inside = self._regions
            if chart.geometry is not None:
                away_m, spacing_m = self._field.distance_m, self._field.resolution_m
                inside = np.where(outside_building(inside, away_m, spacing_m), 0, inside)
            sizes = np.bincount(inside.ravel(), minlength=2)
            largest = int(np.argmax(sizes[1:])) + 1 if count else 0
            self._home = largest if about is None else self._nearest_region(*about) or largest
            return
        self._home = self._region(reachable_from.x_m, reachable_from.y_m)
        if self._home == 0:
            raise InputError(
                f"world.start: expected {clearance_m:g} m to the nearest wall, from where random places are "
                f"reached, found less at ({reachable_from.x_m:g}, {reachable_from.y_m:g})"
            )

    @cached_property
    def easy(self) -> BoolArray:
        """(rows, columns) of it what is beside its largest part whose passages have ``EASY_M`` more room."""
        home = self._regions == self._home
        pieces, count = scipy.ndimage.label(home & (self._field.distance_m >= self._clearance_m + EASY_M))
        if not count:
            return np.asarray(home)
        largest = pieces == 1 + int(np.argmax(np.bincount(pieces.ravel())[1:]))
        steps = math.ceil(STEP_M / self._field.resolution_m)
        return np.asarray(home & scipy.ndimage.binary_dilation(largest, iterations=steps))

    def in_cells(self, first: PoseConfig | None) -> BoolArray:
        """(rows, columns) of it what a task's floor, in cells, reaches from the first who was placed."""
        home = np.asarray(self._regions == self._home)
        inside = None if first is None else (first.x_m, first.y_m)
        try:
            cells = Floor.of(self._chart, self._clearance_m, inside_xy_m=inside)
        except InputError:
            return home
        axes = []
        for count, origin_m, low_m, cell_count in zip(
            home.shape,
            self._field.origin_xy_m[::-1],
            cells.origin_xy_m[::-1],
            cells.reachable.shape,
            strict=True,
        ):
            place_m = origin_m + self._field.resolution_m * np.arange(count)
            axes.append(
                np.clip(np.floor((place_m - low_m) / cells.cell_m).astype(np.int64), 0, cell_count - 1)
            )
        return np.asarray(home & cells.reachable[np.ix_(*axes)])

    def _region(self, x: float, y: float) -> int:
        return int(self._at_nodes(self._regions, np.array([[x, y]]))[0])

    def _nearest_region(self, x: float, y: float) -> int:
        """That of the nearest node that has room, no farther than a task takes a place to be; else 0."""
        low_m = np.asarray(self._field.origin_xy_m)
        columns, rows = (
            np.flatnonzero(np.abs(origin_m + self._field.resolution_m * np.arange(count) - at) <= SNAP_M)
            for origin_m, count, at in zip(low_m, self._regions.shape[::-1], (x, y), strict=True)
        )
        near = self._regions[np.ix_(rows, columns)]
        away_m = np.hypot(
            *np.meshgrid(
                low_m[0] + self._field.resolution_m * columns - x,
                low_m[1] + self._field.resolution_m * rows - y,
            )
        )
        away_m = np.where((near > 0) & (away_m <= SNAP_M), away_m, np.inf)
        if not np.isfinite(away_m).any():
            return 0
        return int(near.ravel()[np.argmin(away_m)])

    def _at_nodes(self, nodes: np.ndarray[Any, Any], points_m: FloatArray) -> np.ndarray[Any, Any]:
        """(N,) what the node nearest to each place has; zero beyond the map."""
        at = np.rint((points_m - np.asarray(self._field.origin_xy_m)) / self._field.resolution_m)
        at = at.astype(np.int64)[:, ::-1]
        inside = np.all((at >= 0) & (at < nodes.shape), axis=1)
        row, column = np.where(inside[:, None], at, 0).T
        return np.asarray(nodes[row, column] * inside)

    def draw(
        self,
        rng: np.random.Generator,
        apart_from: Sequence[tuple[PoseConfig, float]] = (),
        part: BoolArray | None = None,
    ) -> PoseConfig | None:
        """Draw a pose on a part of it, so far from each of some others; None where nothing is found."""
        xmin, ymin, xmax, ymax = self._chart.bounds_m
        low, high = [xmin, ymin, -math.pi], [xmax, ymax, math.pi]
        wanted = self._regions == self._home if part is None else part & (self._regions == self._home)
        for _ in range(MAX_DRAWS // DRAWS_AT_ONCE if self._home else 0):
            before = rng.bit_generator.state
            drawn = rng.uniform(low, high, (DRAWS_AT_ONCE, 3))
            fit = self._at_nodes(wanted, drawn[:, :2])
            for place, spacing_m in apart_from:
                fit &= np.hypot(drawn[:, 0] - place.x_m, drawn[:, 1] - place.y_m) >= spacing_m
            for index in np.flatnonzero(fit).tolist():
                x, y, theta = drawn[index].tolist()
                if room_m(self._chart, x, y, self._clearance_m) >= self._clearance_m:
                    # What is drawn next goes on behind this one, as if they had been drawn one by one.
                    rng.bit_generator.state = before
                    rng.uniform(low, high, (index + 1, 3))
                    return PoseConfig(x_m=x, y_m=y, theta_rad=theta)
        return None


def check_landmarks(chart: WorldMap) -> None:
    """Refuse landmarks that all stand inside solid cells: no sensor ever sees one there.

    Raises
    ------
    InputError
        Where every landmark does.
    """
    grid, points = chart.grid, chart.landmarks.points_xy_m
    if grid is None or chart.open_ground or not len(points):
        return
    solid = grid.blocked(unknown_is_free=True)
    cells = [(int(row), int(column)) for row, column in grid.cells_at(points)]
    if all(grid.contains(row, column) and solid[row, column] for row, column in cells):
        raise InputError(
            f"world.landmarks: expected landmarks that can be seen, found all {len(points)} inside walls; "
            "put them onto free cells beside walls"
        )


def _finer_field(chart: WorldMap) -> DistanceField:
    """Distances to walls, nearer to each other than on the map's own field."""
    return _FIELDS.get(chart, GRID_M, lambda: DistanceField.from_map(chart.walls, GRID_M))
