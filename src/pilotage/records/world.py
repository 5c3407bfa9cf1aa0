"""``world.json``: what stood in the world, what the robots were not told of, and the robots' outlines."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.numbers import Pose, place, pose, table
from pilotage.records.reading import broken, clean_text, is_there, object_of

WORLD_FILE = "world.json"


def _no_points() -> FloatArray:
    return np.empty((0, 2))


def _no_circles() -> FloatArray:
    return np.empty((0, 3))


def _no_segments() -> FloatArray:
    return np.empty((0, 4))


@dataclass(frozen=True, slots=True)
class Landmark:
    """A beacon on the map."""

    id: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class RobotOutline:
    """A robot as it is drawn.

    Attributes
    ----------
    radius_m
        Of a disc, or of the circle about the origin that encloses a polygon; None where unknown.
    polygon_m
        (K, 2) corners in the robot's frame; none for a disc.
    start, goals
        Where it began, and where it was sent, in order.
    """

    name: str = ""
    radius_m: float | None = None
    polygon_m: FloatArray = field(default_factory=_no_points)
    start: Pose | None = None
    goals: tuple[Pose, ...] = ()

    @property
    def half_length_m(self) -> float | None:
        """A disc's radius, half of a polygon's longer side along its axes; None where unknown."""
        if not len(self.polygon_m):
            return self.radius_m
        return 0.5 * float(np.ptp(self.polygon_m, axis=0).max())


@dataclass(frozen=True, slots=True)
class World:
    """What stood in the world: the known map first, then what the robot was not told about.

    Attributes
    ----------
    segments_m, circles_m
        (S, 4) walls x0, y0, x1, y1 and (C, 3) columns x, y, radius that the robot knew.
    obstacle_segments_m, obstacle_circles_m, obstacle_polygons_m
        The same of what it was not told; polygons are (K, 2) outlines of what the segments enclose.
    bounds_m
        xmin, ymin, xmax, ymax of the floor.
    boxes_m, lines_m, tape_width_m, cells
        Of a sheet: (K, 4) boxes x0, y0, x1, y1, the tapes' corners (N, 2), their width, and the columns
        and rows that its map has.
    robots
        One or more; the first one's outline, start and goal are at hand by themselves.
    """

    segments_m: FloatArray = field(default_factory=_no_segments)
    circles_m: FloatArray = field(default_factory=_no_circles)
    landmarks: tuple[Landmark, ...] = ()
    obstacle_segments_m: FloatArray = field(default_factory=_no_segments)
    obstacle_circles_m: FloatArray = field(default_factory=_no_circles)
    obstacle_polygons_m: tuple[FloatArray, ...] = ()
    bounds_m: tuple[float, float, float, float] | None = None
    robots: tuple[RobotOutline, ...] = ()
    boxes_m: FloatArray = field(default_factory=_no_segments)
    lines_m: tuple[FloatArray, ...] = ()
    tape_width_m: float | None = None
    cells: tuple[int, int] | None = None

    @property
    def robot_radius_m(self) -> float | None:
        """Radius of the first robot; None where unknown."""
        return self.robots[0].radius_m if self.robots else None

    @property
    def start(self) -> Pose | None:
        """Where the first robot began."""
        return self.robots[0].start if self.robots else None

    @property
    def goal(self) -> Pose | None:
        """Where the first robot was to end; None where it had no goal."""
        return self.robots[0].goals[-1] if self.robots and self.robots[0].goals else None

    @property
    def has_obstacles(self) -> bool:
        """Whether there was anything that the robot was not told about."""
        unexpected = (self.obstacle_segments_m, self.obstacle_circles_m, self.obstacle_polygons_m)
        return any(len(things) > 0 for things in unexpected)


def landmarks_of(ids: Any, points_xy_m: FloatArray) -> tuple[Landmark, ...]:
    """Landmarks from their (N,) ids and (N, 2) places."""
    return tuple(Landmark(str(i), float(x), float(y)) for i, (x, y) in zip(ids, points_xy_m, strict=True))


def write_world(folder: Path, world: World) -> None:
    """Write the world; what it has none of is left out, but for walls, landmarks, start and goal."""
    first = world.robots[0] if world.robots else RobotOutline()
    values: dict[str, Any] = {
        "segments_m": world.segments_m.tolist(),
        "circles_m": world.circles_m.tolist(),
        "bounds_m": None if world.bounds_m is None else list(world.bounds_m),
        "landmarks": [
            {"id": int(mark.id) if mark.id.isdecimal() else mark.id, "x_m": mark.x_m, "y_m": mark.y_m}
            for mark in world.landmarks
        ],
        "obstacle_segments_m": world.obstacle_segments_m.tolist(),
        "obstacle_circles_m": world.obstacle_circles_m.tolist(),
        "obstacle_polygons_m": [polygon.tolist() for polygon in world.obstacle_polygons_m],
        **_outline_values(first),
        "goal": None if world.goal is None else list(world.goal),
    }
    if len(world.robots) > 1:
        values["robots"] = [{"name": robot.name, **_outline_values(robot)} for robot in world.robots]
    if world.tape_width_m is not None:
        values |= {
            "boxes_m": world.boxes_m.tolist(),
            "lines_m": [line.tolist() for line in world.lines_m],
            "tape_width_m": world.tape_width_m,
        }
    if world.cells is not None:
        values["cells"] = list(world.cells)
    (folder / WORLD_FILE).write_text(json.dumps(values), encoding="utf-8")


def _outline_values(robot: RobotOutline) -> dict[str, Any]:
    values: dict[str, Any] = {
        "robot_radius_m": robot.radius_m,
        "start": None if robot.start is None else list(robot.start),
    }
    if len(robot.polygon_m):
        values["footprint_m"] = robot.polygon_m.tolist()
    if len(robot.goals) > 1:
        values["goals"] = [list(goal) for goal in robot.goals]
    elif robot.goals:
        values["goal"] = list(robot.goals[0])
    return values


def read_world(folder: Path) -> World:
    """Read the world; an empty one where there is no such file.

    Raises
    ------
    InputError
        One line, where something in it is not what it should be.
    """
    path = folder / WORLD_FILE
    if not is_there(path):
        return World()
    content = object_of(path, "a run's world")
    try:
        return _world(content)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise broken(path, error) from None


def _world(content: Mapping[str, Any]) -> World:
    cells = content.get("cells")
    if cells is not None and not _two_counts(cells):
        raise ValueError("cells: expected columns and rows")
    tape = content.get("tape_width_m")
    robots = content.get("robots")
    return World(
        segments_m=table(content.get("segments_m"), 4),
        circles_m=table(content.get("circles_m"), 3),
        landmarks=tuple(_landmark(entry) for entry in content.get("landmarks") or ()),
        obstacle_segments_m=table(content.get("obstacle_segments_m"), 4),
        obstacle_circles_m=table(content.get("obstacle_circles_m"), 3),
        obstacle_polygons_m=tuple(table(p, 2) for p in content.get("obstacle_polygons_m") or ()),
        bounds_m=_bounds(content.get("bounds_m")),
        robots=tuple(_outline(entry) for entry in robots) if robots else (_outline(content),),
        boxes_m=table(content.get("boxes_m"), 4),
        lines_m=tuple(table(line, 2) for line in content.get("lines_m") or ()),
        tape_width_m=None if tape is None else place(tape, "tape_width_m"),
        cells=None if cells is None else (cells[0], cells[1]),
    )


def _two_counts(values: object) -> bool:
    return isinstance(values, list) and len(values) == 2 and all(type(v) is int and v > 0 for v in values)


def _landmark(entry: Any) -> Landmark:
    if not isinstance(entry, Mapping) or not {"id", "x_m", "y_m"} <= set(entry):
        raise ValueError("landmarks: expected objects with id, x_m and y_m")
    x_m, y_m = (place(entry[key], "landmarks") for key in ("x_m", "y_m"))
    return Landmark(clean_text(str(entry["id"])[:80]), x_m, y_m)


def _outline(entry: Any) -> RobotOutline:
    if not isinstance(entry, Mapping):
        raise ValueError("robots: expected objects")
    polygon = table(entry.get("footprint_m"), 2)
    radius = entry.get("robot_radius_m")
    radius_m = math.nan if radius is None else place(radius, "robot_radius_m")
    if not radius_m > 0.0 and len(polygon):
        radius_m = float(np.hypot(*polygon.T).max())
    goals = [pose(goal, "goals") for goal in entry.get("goals") or (entry.get("goal"),)]
    return RobotOutline(
        name=clean_text(str(entry.get("name", ""))),
        radius_m=radius_m if radius_m > 0.0 else None,
        polygon_m=polygon,
        start=pose(entry.get("start"), "start"),
        goals=tuple(goal for goal in goals if goal is not None),
    )


def _bounds(values: object) -> tuple[float, float, float, float] | None:
    """The floor's rectangle; None where there is none, or it has no area."""
    if not isinstance(values, list) or len(values) != 4:
        return None
    x_min, y_min, x_max, y_max = (place(value, "bounds_m") for value in values)
    return (x_min, y_min, x_max, y_max) if x_max > x_min and y_max > y_min else None
