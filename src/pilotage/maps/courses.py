"""Courses harder than BARN's: a lane of posts with barriers whose only opening has a given width."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

RADIUS_M = 0.075
WIDTH_M = 4.5
SPACING_M = 0.14
"""Between the posts of a wall: they overlap a little, nothing fits between."""
FIRST_M = 2.0
APART_M = 1.9
"""Barriers stand so far apart: room to turn towards the next opening."""
TILT_M = 0.5
"""A barrier's ends may lie so far ahead of or behind its middle."""
TRIES = 400


@dataclass(frozen=True, slots=True)
class Course:
    """A lane along +y with the start at the origin, heading +y.

    Attributes
    ----------
    circles_m
        (N, 3) x, y, radius of the posts.
    start
        x, y, theta.
    goal_xy_m
        Beyond the last barrier.
    openings
        (B, 3) x, y of each opening's middle and the direction through it.
    """

    circles_m: FloatArray
    start: tuple[float, float, float]
    goal_xy_m: tuple[float, float]
    openings: FloatArray


def make_course(
    bottleneck_m: float, generator: np.random.Generator, barriers: int = 3, posts: int = 12
) -> Course:
    """Make a course whose every barrier has one opening of the given width, with loose posts between them.

    A loose post stands off the straight ways to, through and between the openings by more than a robot is
    wide, so the bottleneck is the barriers'. Whether a given robot gets through is for a planner to say.

    Raises
    ------
    InputError
        For a width or numbers that make no course.
    """
    if not 0.05 <= bottleneck_m <= 2.0:
        raise InputError(f"course: expected a bottleneck from 0.05 to 2 m, found {bottleneck_m} m")
    if not (1 <= barriers <= 20 and 0 <= posts <= 200):
        raise InputError(
            f"course: expected 1 to 20 barriers and up to 200 posts, found {barriers} and {posts}"
        )
    length = FIRST_M + APART_M * barriers + 1.0
    half = 0.5 * WIDTH_M
    circles = _wall((-half, -1.0), (half, -1.0))
    circles += _wall((-half, -1.0), (-half, length)) + _wall((half, -1.0), (half, length))
    openings = []
    for k in range(barriers):
        middle_y = FIRST_M + APART_M * k
        tilt = generator.uniform(-TILT_M, TILT_M)
        along = np.array([WIDTH_M, 2.0 * tilt]) / math.hypot(WIDTH_M, 2.0 * tilt)
        x = generator.uniform(-half + 0.7, half - 0.7)
        middle = np.array([x, middle_y + 2.0 * tilt * x / WIDTH_M])
        # The posts beside the opening have their surfaces, not their middles, on its edges.
        edge = (0.5 * bottleneck_m + RADIUS_M) * along
        left = np.array([-half, middle_y - tilt])
        right = np.array([half, middle_y + tilt])
        circles += _wall(tuple(middle - edge), tuple(left)) + _wall(tuple(middle + edge), tuple(right))
        openings.append([middle[0], middle[1], math.atan2(along[0], -along[1])])
    goal = (0.0, length + 1.0)
    way = straight_way(np.array(openings), goal)
    loose: list[list[float]] = []
    for _ in range(TRIES):
        if len(loose) == posts:
            break
        place = generator.uniform([-half, 0.8], [half, length])
        if _distance_to_way(place, way) > 0.55 + RADIUS_M:
            loose.append([float(place[0]), float(place[1]), RADIUS_M])
    return Course(np.array(circles + loose), (0.0, 0.0, 0.5 * math.pi), goal, np.array(openings))


def _wall(begin: tuple[float, ...], end: tuple[float, ...]) -> list[list[float]]:
    """Posts from one point to another, the first exactly on its beginning."""
    length = math.hypot(end[0] - begin[0], end[1] - begin[1])
    count = max(1, math.ceil(length / SPACING_M))
    return [
        [begin[0] + (end[0] - begin[0]) * i / count, begin[1] + (end[1] - begin[1]) * i / count, RADIUS_M]
        for i in range(count + 1)
    ]


def straight_way(openings: FloatArray, goal: tuple[float, float]) -> FloatArray:
    """(K, 2) corners of the way from the start straight through each of the openings (B, 3) to the goal."""
    corners = [[0.0, 0.0]]
    for x, y, direction in openings:
        ahead = 0.5 * np.array([math.cos(direction), math.sin(direction)])
        corners += [[x - ahead[0], y - ahead[1]], [x + ahead[0], y + ahead[1]]]
    corners.append([goal[0], goal[1]])
    return np.array(corners)


def _distance_to_way(place: FloatArray, corners: FloatArray) -> float:
    """Distance from a point to a way of straight pieces."""
    begin, step = corners[:-1], np.diff(corners, axis=0)
    t = np.clip(((place - begin) * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(begin + t[:, None] * step - place).T).min())
