"""The places of a mission: checked, and those that the seed draws."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.experiments.build.obstacles import Obstacles
from pilotage.experiments.build.open_floor import OpenFloor, random_pose, room_m
from pilotage.experiments.build.random_places import ROOM_M, RandomPlaces
from pilotage.experiments.build.robots import footprint_of
from pilotage.maps.occupancy_grid import UNKNOWN
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig, Kidnap, PoseConfig
from pilotage.missions.robot import RobotConfig
from pilotage.models.footprint import Footprint


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
        hint = "; give one, or have it drawn (world.random_start: {})"
        if strategy is not None and size is None:
            hint = "; a team's are drawn where team.size is given"
        raise InputError(f"world.start: expected a start pose, found none{hint}")
    if sheet.start_pose is None:
        return PoseConfig(x_m=0.5 * sheet.size_m[0], y_m=0.5 * sheet.size_m[1])
    x, y, theta = sheet.start_pose
    if not all(map(math.isfinite, sheet.start_pose)):
        raise InputError(f"sheet: start_pose: expected finite numbers, found {sheet.start_pose}")
    return PoseConfig(x_m=x, y_m=y, theta_rad=wrap_to_pi(theta))


def settle_places(mission: Mission, chart: WorldMap, about: tuple[float, float] | None = None) -> Mission:
    """Return the mission with all its places known, so that it can be recorded and run again as it is.

    A random start without ``world.start`` is drawn on the floor that is meant. A team's starts are drawn on
    the floor of the place that the task is ``about``, if it is about one. Goals are drawn apart, each on the
    floor of its robot's start.
    """
    if mission.team.size is not None:
        mission = _with_drawn_starts(mission, chart, about)
    world = mission.world
    streams = RandomStreams(mission.run.seed)
    draws = random_places(mission, chart, Obstacles.fixed(world.obstacles))
    starts = _starts(mission, draws, streams.stream("start"))
    rng = streams.stream("kidnap")
    kidnaps = tuple(
        kidnap if kidnap.to is not None else _carried(kidnap, chart, draws[kidnap.robot].given, rng)
        for kidnap in world.kidnaps
    )
    if world.random_start is not None or None in map(mission.start_of, mission.members):
        mission = _with(mission, "start", starts)
    if world.random_goal is not None:
        mission = _with(mission, "goal", _goals(mission, draws, starts, streams.stream("goal")))
    settled = {"random_start": None, "random_goal": None, "kidnaps": kidnaps}
    return mission.model_copy(update={"world": mission.world.model_copy(update=settled)})


def random_places(mission: Mission, chart: WorldMap, obstacles: Obstacles) -> list[RandomPlaces]:
    """What draws each robot's start and goal, clear of obstacles that are on no map.

    Raises
    ------
    InputError
        As ``start_pose``.
    """
    world = mission.world
    draws_start = world.random_start is not None and chart.markings is None
    bodies = _bodies(mission)
    return [
        RandomPlaces(
            world,
            chart,
            obstacles,
            mission.start_of(robot) if draws_start else start_pose(mission, index, chart),
            mission.goal_of(robot),
            bodies[index],
        )
        for index, robot in enumerate(mission.members)
    ]


def _starts(mission: Mission, draws: Sequence[RandomPlaces], rng: np.random.Generator) -> list[PoseConfig]:
    """A start for each robot: those that are drawn, apart from the others before."""
    starts: list[PoseConfig] = []
    radii_m = _radii_m(mission)
    for draw, own_m in zip(draws, radii_m, strict=True):
        others = [(start, own_m + ROOM_M + other_m) for start, other_m in zip(starts, radii_m, strict=False)]
        starts.append(draw.start(rng, others))
    return starts


def _goals(
    mission: Mission, draws: Sequence[RandomPlaces], starts: Sequence[PoseConfig], rng: np.random.Generator
) -> list[GoalConfig]:
    """A goal for each robot: none where it begins, nor where another one that is there leaves it no room."""
    goals: list[GoalConfig] = []
    rooms_m = [
        draw.goal_like.tolerance_m + radius_m for draw, radius_m in zip(draws, _radii_m(mission), strict=True)
    ]
    for draw, start, own_m in zip(draws, starts, rooms_m, strict=True):
        others = [(goal, own_m + other_m) for goal, other_m in zip(goals, rooms_m, strict=False)]
        goals.append(draw.goal(rng, [(start, own_m), *others]))
    return goals


def _bodies(mission: Mission) -> list[Footprint]:
    where = "robots.{}" if mission.robots else "robot"
    return [footprint_of(robot, where.format(index)) for index, robot in enumerate(mission.members)]


def _radii_m(mission: Mission) -> list[float]:
    return [body.radius_m for body in _bodies(mission)]


def _with(mission: Mission, place: str, drawn: Sequence[PoseConfig | GoalConfig]) -> Mission:
    """The mission with its starts, or goals, where they belong: one robot's in the world, else its own."""
    if not mission.robots and getattr(mission.robot, place) is None:
        return mission.model_copy(update={"world": mission.world.model_copy(update={place: drawn[0]})})
    if not mission.robots:
        return mission.model_copy(update={"robot": mission.robot.model_copy(update={place: drawn[0]})})
    robots = tuple(
        robot.model_copy(update={place: one}) for robot, one in zip(mission.robots, drawn, strict=True)
    )
    return mission.model_copy(update={"robots": robots})


def _with_drawn_starts(mission: Mission, chart: WorldMap, about: tuple[float, float] | None) -> Mission:
    """The mission with a place for every robot that has none: drawn in turn, apart from those before.

    They are places that ``world.start`` is connected to, or what the task is about, or on the floor that is
    meant, for the widest of the team: what its task asks of all lies where each of them can be.

    Raises
    ------
    InputError
        Where the floor has no room for so many.
    """
    rng = RandomStreams(mission.run.seed).stream("starts")
    near = mission.world.start
    radii_m = _radii_m(mission)
    placed: list[tuple[PoseConfig, float]] = [
        (robot.start, radius_m)
        for robot, radius_m in zip(mission.robots, radii_m, strict=True)
        if robot.start is not None
    ]
    if len(placed) == len(mission.robots):
        return mission
    robots: list[RobotConfig] = []
    clear_m = max(radii_m) + ROOM_M
    floor, is_full = OpenFloor(chart, clear_m, near, about), False
    for index, robot in enumerate(mission.robots):
        start = robot.start
        if start is None:
            # Bodies stand apart however little is asked for.
            apart = [
                (place, max(mission.team.spacing_m, radii_m[index] + ROOM_M + radius_m))
                for place, radius_m in placed
            ]
            if not is_full:
                start = floor.draw(rng, apart, floor.easy)
            if start is None:
                is_full = True
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
            f"{ymin:g} to {ymax:g} m), found ({x_m:g}, {y_m:g}); move it{_or_drawn(where)}"
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


def _or_drawn(where: str) -> str:
    """The other remedy for a place that another map's mission was given."""
    of, _, place = where.partition(".")
    if of != "world" or place not in ("start", "goal"):
        return ""
    return f", or have one drawn ({where}: null, world.random_{place}: {{}})"


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


def pose_of(place: PoseConfig) -> Pose2:
    """The pose that a mission file says."""
    return Pose2(place.x_m, place.y_m, wrap_to_pi(place.theta_rad))


def _carried(kidnap: Kidnap, chart: WorldMap, near: PoseConfig | None, rng: np.random.Generator) -> Kidnap:
    return kidnap.model_copy(update={"to": random_pose(chart, near, kidnap.clearance_m, rng)})


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
