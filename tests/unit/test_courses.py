"""The generator of courses, and the search that tells which can be passed."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.kernels.arrays import read_only
from pilotage.kernels.control.pose_search import CLOSED, FOUND, passage
from pilotage.maps.courses import Course, make_course

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])


def status(course: Course) -> int:
    """Whether the footprint gets through, all posts known."""
    x, y = course.goal_xy_m
    found, length = passage(
        np.array(course.start),
        x,
        y,
        0.5,
        read_only(JACKAL),
        course.circles_m,
        np.array([-2.5, -1.2]),
        np.array([2.5, y + 0.6]),
        0.04,
        0.0,
    )
    assert found != FOUND or length >= y - 0.6
    return found


@pytest.mark.parametrize("width", [0.3, 0.45, 0.6, 1.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_opening_has_its_width(width: float, seed: int) -> None:
    course = make_course(width, np.random.default_rng(seed))
    for x, y, _ in course.openings:
        away = np.hypot(course.circles_m[:, 0] - x, course.circles_m[:, 1] - y) - course.circles_m[:, 2]
        assert np.sort(away)[:2] == pytest.approx([0.5 * width, 0.5 * width], abs=1e-9)


def test_the_same_generator_makes_the_same_course() -> None:
    one, two = (make_course(0.5, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one.circles_m, two.circles_m)


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_passes_what_is_wider_than_it_and_nothing_narrower(seed: int) -> None:
    assert status(make_course(0.60, np.random.default_rng(seed))) == FOUND
    assert status(make_course(0.40, np.random.default_rng(seed))) == CLOSED


def test_numbers_that_make_no_course_are_refused() -> None:
    with pytest.raises(InputError, match="bottleneck"):
        make_course(0.0, np.random.default_rng(0))
    with pytest.raises(InputError, match="barriers"):
        make_course(0.5, np.random.default_rng(0), barriers=0)
