"""Kinds of courses for local controllers: drawn ones, places of any map, crossings among people."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.barn import lane_within
from pilotage.evaluation.least_time import least_time_s, time_bound_s
from pilotage.experiments.build.charts import load_chart
from pilotage.kernels.arrays import read_only
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.control.pose_search import CLOSED, FOUND, passage
from pilotage.logs.people import read_people
from pilotage.maps.courses import Course as LaneCourse
from pilotage.maps.courses import make_course, straight_way
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MotionConfig

DOORS, CORRIDOR, CROWD = "doors", "corridor", "crowd"
BOTTLENECKS_M = (0.36, 0.40, 0.44, 0.46, 0.48, 0.50, 0.55, 0.60)
DRAWN = (DOORS, CORRIDOR, CROWD, *(f"bottleneck-{width:.2f}" for width in BOTTLENECKS_M))
"""Families that need no file."""
TOLERANCE_M = 1.0
CROSSING_M = 6.0
"""A crossing goes so far to either side of the middle of where people walk."""
HALL_M = 9.0
CLEAR_M = 0.05
"""Room around the robot, however it stands, at start and goal on a map."""
APART_M = (2.5, 12.0)
STEP_M = 0.01
AROUND_M = 3.0
TRIES = 1000
STARTS = 200
"""Most places tried as a start."""
SEARCHES = 20
MOST_CELLS = 200_000
CELL_M = 0.04


@dataclass(frozen=True, slots=True)
class Course:
    """One course.

    Attributes
    ----------
    family, number
        Its kind, and which of it.
    settings
        By dotted key, what is set in the mission ``barn-course``.
    bound_s
        Least time of a robot that knows the course.
    """

    family: str
    number: int
    settings: Mapping[str, Any]
    bound_s: float
    people: tuple[Mapping[str, Any], ...] = field(default=())


@dataclass(frozen=True, slots=True)
class Driver:
    """What of the robot the courses depend on."""

    footprint: Footprint
    outline: FloatArray
    motion: MotionConfig


def make_course_of(family: str, number: int, seed: int, driver: Driver) -> Course | None:
    """Draw a course; None where the robot has no way through it.

    Raises
    ------
    InputError
        Where a file is not what it should be.
    """
    rng = np.random.default_rng([seed, number, *family_word(family)])
    if family == DOORS:
        return _walled(family, number, *_doors(rng), driver)
    if family == CORRIDOR:
        return _walled(family, number, *_corridor(rng), driver)
    if family == CROWD:
        return _crowd(number, rng, driver)
    if family.startswith("bottleneck-"):
        return _bottleneck(family, number, float(family.rsplit("-", 1)[1]), rng, driver)
    if family.endswith(".txt"):
        return _crossing(family, number, rng, driver)
    return _on_map(family, number, rng, driver)


def family_word(family: str) -> bytes:
    """What of a family its draws depend on: of a file its name alone, wherever it lies and is called from."""
    return os.fsencode(Path(family).name)


def _places(start: tuple[float, float, float], goal: tuple[float, float]) -> dict[str, Any]:
    return {
        "world.start": dict(zip(("x_m", "y_m", "theta_rad"), start, strict=True)),
        "world.goal": {"x_m": goal[0], "y_m": goal[1], "tolerance_m": TOLERANCE_M},
    }


def _walled(
    family: str,
    number: int,
    walls: FloatArray,
    start: tuple[float, float, float],
    goal: tuple[float, float],
    driver: Driver,
    people: tuple[Mapping[str, Any], ...] = (),
) -> Course | None:
    """A course of straight walls; None where the body's inner disc fits not at its ends, or not between."""
    low, high = walls.reshape(-1, 2).min(axis=0) - 0.5, walls.reshape(-1, 2).max(axis=0) + 0.5
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    floor = SegmentMap(walls, np.zeros((0, 3)), bounds)
    inner, motion = driver.footprint.inner_radius_m, driver.motion
    if min(floor.distance_m(*start[:2]), floor.distance_m(*goal)) < inner:
        return None
    limits = motion.top_speed_m_s, motion.braking_m_s2
    bound = time_bound_s(floor, start[:2], goal, TOLERANCE_M, inner, *limits)
    if bound is None:
        return None
    drawn = {
        "map": f"{family}-{number}",
        "bounds_m": list(bounds),
        "walls_m": walls.tolist(),
        "circles_m": [],
    }
    return Course(family, number, {"world.map": drawn, **_places(start, goal)}, bound, people)


def _bound_s(
    floor: SegmentMap, start: tuple[float, float, float], goal: tuple[float, float], driver: Driver
) -> float:
    """Least time by the exact shortest path; where there is none on the floor, by the straight line."""
    motion, inner = driver.motion, driver.footprint.inner_radius_m
    limits = motion.top_speed_m_s, motion.braking_m_s2
    bound = time_bound_s(floor, start[:2], goal, TOLERANCE_M, inner, *limits)
    if bound is None:
        return least_time_s(math.hypot(goal[0] - start[0], goal[1] - start[1]) - TOLERANCE_M, *limits)
    return bound


def _hall(width: float, depth: float) -> list[list[float]]:
    return [[0, 0, width, 0], [width, 0, width, depth], [width, depth, 0, depth], [0, depth, 0, 0]]


def _doors(rng: np.random.Generator) -> tuple[FloatArray, tuple[float, float, float], tuple[float, float]]:
    """Four rooms in a row, a door of 0.7 to 1.0 m somewhere in each wall between."""
    width, depth = 5.0, 3.0
    walls = _hall(width, 4 * depth)
    for k in range(1, 4):
        opening, left = rng.uniform(0.7, 1.0), rng.uniform(0.4, width - 1.4)
        walls += [[0, k * depth, left, k * depth], [left + opening, k * depth, width, k * depth]]
    return np.array(walls, dtype=float), (2.5, 0.8, 0.5 * math.pi), (2.5, 4 * depth - 0.8)


def _corridor(rng: np.random.Generator) -> tuple[FloatArray, tuple[float, float, float], tuple[float, float]]:
    """A corridor of 0.7 to 1.1 m with four bends at right angles, left and right by turns."""
    half = 0.5 * rng.uniform(0.7, 1.1)
    legs = rng.uniform(2.0, 3.5, 5)
    points, direction, turn = [np.zeros(2)], np.array([0.0, 1.0]), float(rng.choice([-1.0, 1.0]))
    for leg in legs:
        points.append(points[-1] + leg * direction)
        direction = turn * np.array([-direction[1], direction[0]])
        turn = -turn
    middle = np.array(points)
    steps = np.diff(middle, axis=0)
    along = steps / np.hypot(*steps.T)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    ends = np.vstack([middle[0] - half * along[0], middle[1:-1], middle[-1] + half * along[-1]])
    # At a bend both legs' offsets meet in one corner.
    offset = np.vstack([across[:1], across[:-1] + across[1:], across[-1:]]) * half
    left, right = ends + offset, ends - offset
    rows = [np.hstack([side[:-1], side[1:]]) for side in (left, right)]
    caps = np.array([[*left[0], *right[0]], [*left[-1], *right[-1]]])
    goal = middle[-1] - 0.2 * along[-1]
    return np.vstack([*rows, caps]), (0.0, 0.0, 0.5 * math.pi), (float(goal[0]), float(goal[1]))


def _crowd(number: int, rng: np.random.Generator, driver: Driver) -> Course | None:
    """Across a hall with four pillars in which twelve people walk between its sides."""
    walls = _hall(12.0, 12.0)
    for x, y in ((4.0, 4.0), (8.0, 4.0), (4.0, 8.0), (8.0, 8.0)):
        walls += box_segments(x, y, 0.4, 0.4, float(rng.uniform(0.0, 1.5))).tolist()
    doors = [[0.8, 6.0], [11.2, 6.0], [6.0, 0.8], [6.0, 11.2], [0.8, 0.8], [11.2, 11.2]]
    people = ({"name": "social-force", "count": 12, "doors_m": doors},)
    start = (float(rng.uniform(2.0, 10.0)), 1.5, 0.5 * math.pi)
    goal = (float(rng.uniform(2.0, 10.0)), 10.5)
    return _walled(CROWD, number, np.array(walls, dtype=float), start, goal, driver, people)


def _bottleneck(
    family: str, number: int, width_m: float, rng: np.random.Generator, driver: Driver
) -> Course | None:
    """Barriers whose only opening is so wide; None where a robot that knows the course finds no way.

    Such a robot drives the straight way through the middle of each opening and turns on the spot at its
    corners; where that does not fit, another way is searched for over poses.
    """
    made = make_course(width_m, rng)
    x, y = made.goal_xy_m
    low, high = np.array([-2.5, -1.2]), np.array([2.5, y + 0.6])
    if not _drives_straight(made, driver):
        status, _ = passage(
            np.array(made.start), x, y, TOLERANCE_M, read_only(driver.outline),
            made.circles_m, low, high, CELL_M, 0.0,
        )  # fmt: skip
        if status == CLOSED:
            return None
    drawn = {
        "map": f"{family}-{number}",
        "bounds_m": [-4.5, -3.0, 4.5, y + 2.0],
        "walls_m": [],
        "circles_m": made.circles_m.tolist(),
    }
    bound = _bound_s(lane_within(made.circles_m, -0.9, y + 1.0), made.start, (x, y), driver)
    return Course(family, number, {"world.map": drawn, **_places(made.start, (x, y))}, bound)


def _drives_straight(made: LaneCourse, driver: Driver) -> bool:
    """Whether the outline touches nothing on the straight way through the openings' middles."""
    corners = straight_way(made.openings, made.goal_xy_m)
    outline, sides = read_only(driver.outline), read_only(np.empty((0, 4)))
    for here, there in itertools.pairwise(corners):
        length, angle = math.hypot(*(there - here)), math.atan2(*(there - here)[::-1])
        c, s = math.cos(angle), math.sin(angle)
        to_corner = np.hypot(*(made.circles_m[:, :2] - here).T) - made.circles_m[:, 2]
        if to_corner.min() < driver.footprint.radius_m:
            return False
        near = read_only(made.circles_m[_beside(made.circles_m, here, there) < driver.footprint.radius_m])
        for along in np.arange(0.0, length, STEP_M):
            x, y = here[0] + along * c, here[1] + along * s
            if near.size and outline_clearance(x, y, c, s, outline, 0.0, sides, near) <= 0.0:
                return False
    return True


def _beside(circles_m: FloatArray, here: FloatArray, there: FloatArray) -> FloatArray:
    """(N,) distances of discs from a straight piece."""
    step = there - here
    t = np.clip((circles_m[:, :2] - here) @ step / float(step @ step), 0.0, 1.0)
    return np.asarray(np.hypot(*(here + t[:, None] * step - circles_m[:, :2]).T) - circles_m[:, 2])


def _crossing(file: str, number: int, rng: np.random.Generator, driver: Driver) -> Course | None:
    """Across the middle of where recorded people walk, in any direction, at a time when somebody is there."""
    tracks = read_people(Path(file))
    middle = np.median(tracks.places_xy_m, axis=0)
    for _ in range(TRIES):
        angle, begins_s = rng.uniform(-math.pi, math.pi), rng.uniform(0.0, max(tracks.duration_s - 20.0, 1.0))
        away = CROSSING_M * np.array([math.cos(angle), math.sin(angle)])
        _, places = tracks.at(begins_s)
        near = np.hypot(*(places - (middle - away)).T)
        if near.size and near.min() > 1.5 + driver.footprint.radius_m:
            break
    else:
        raise InputError(
            f"{file}: expected a time at which people leave room for a robot to start, found none"
        )
    corner = middle - HALL_M
    walls = np.array(_hall(2 * HALL_M, 2 * HALL_M)) + np.tile(corner, 2)
    begin, goal = middle - away, middle + away
    people = ({"name": "track", "file": str(Path(file).absolute()), "begins_s": float(begins_s)},)
    start = (float(begin[0]), float(begin[1]), float(angle))
    return _walled(file, number, walls, start, (float(goal[0]), float(goal[1])), driver, people)


def _two_places(
    file: str, field: DistanceField, rng: np.random.Generator, driver: Driver
) -> tuple[FloatArray, FloatArray]:
    """Two places where the robot may stand and turn, with a way between: a wide one, or one found over poses.

    Raises
    ------
    InputError
        Where there are none.
    """
    shape, spacing = driver.footprint, field.resolution_m
    wide, _ = scipy.ndimage.label(field.distance_m > shape.radius_m)
    narrow, _ = scipy.ndimage.label(field.distance_m > shape.inner_radius_m)
    cells = np.argwhere(field.distance_m > shape.radius_m + CLEAR_M)
    if not len(cells):
        raise InputError(f"{file}: expected a map with room for the robot, found none")
    solid = np.array(field.origin_xy_m) + spacing * np.argwhere(field.distance_m <= 0.5 * spacing)[:, ::-1]
    searched = 0
    for number in rng.permutation(len(cells))[:STARTS]:
        one = tuple(cells[number])
        away_m = spacing * np.hypot(*(cells - one).T)
        joined = narrow[cells[:, 0], cells[:, 1]] == narrow[one]
        others = cells[joined & (away_m >= APART_M[0]) & (away_m <= APART_M[1])]
        if not len(others):
            continue
        other = tuple(others[rng.integers(len(others))])
        start, goal = (np.array(field.origin_xy_m) + spacing * np.array(cell[::-1]) for cell in (one, other))
        if wide[one] == wide[other]:
            return start, goal
        searched += 1
        if searched <= SEARCHES and _has_passage(start, goal, solid, spacing, driver):
            return start, goal
    raise InputError(
        f"{file}: expected two places {APART_M[0]:g} to {APART_M[1]:g} m apart with a way between, found none"
    )


def _has_passage(
    start: FloatArray, goal: FloatArray, solid: FloatArray, spacing_m: float, driver: Driver
) -> bool:
    """Whether the outline gets through between solid nodes (N, 2), no farther around than ``AROUND_M``."""
    low, high = np.minimum(start, goal) - AROUND_M, np.maximum(start, goal) + AROUND_M
    near = solid[((solid > low - 1.0) & (solid < high + 1.0)).all(axis=1)]
    discs = np.column_stack([near, np.full(len(near), spacing_m / math.sqrt(2.0))])
    heading = math.atan2(goal[1] - start[1], goal[0] - start[0])
    status, _ = passage(
        np.array([*start, heading]), goal[0], goal[1], TOLERANCE_M, read_only(driver.outline),
        discs, low, high, max(CELL_M, math.sqrt(float(np.prod(high - low)) / MOST_CELLS)), 0.0,
    )  # fmt: skip
    return bool(status == FOUND)


def _on_map(file: str, number: int, rng: np.random.Generator, driver: Driver) -> Course:
    """From one place to another on a map that the robot is not told of."""
    chart = load_chart(file)
    start, goal = _two_places(file, chart.field, rng, driver)
    heading = math.atan2(goal[1] - start[1], goal[0] - start[0])
    begin = (float(start[0]), float(start[1]), heading)
    end = (float(goal[0]), float(goal[1]))
    motion = driver.motion
    # Grids have too many sides for the exact path: the straight line is a bound as well.
    away = math.hypot(*(goal - start)) - TOLERANCE_M
    bound = least_time_s(float(away), motion.top_speed_m_s, motion.braking_m_s2)
    return Course(file, number, {"world.map": str(Path(file).absolute()), **_places(begin, end)}, bound)
