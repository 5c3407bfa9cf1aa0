"""Scans without odometry: what is looked at beside where they were aligned, and how seldom more is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import composed
from pilotage.kernels.slam.local_map import LocalMap, add_to_map, empty_map
from pilotage.kernels.slam.neighbourhood import best_near, weak_course
from pilotage.kernels.slam.scan_lines import scan_cloud
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import track
from support.laser_rooms import BEAMS, SPAN_RAD, along, furnished, ranges, recording

ANGLES = np.linspace(-0.5 * SPAN_RAD, 0.5 * SPAN_RAD, BEAMS)
RAYS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
HERE = np.array([2.0, 3.5, 0.2])


def cloud(pose: FloatArray) -> FloatArray:
    return scan_cloud(ranges(furnished(), pose, ANGLES), RAYS, float(ANGLES[1] - ANGLES[0]), 0.1, 30.0)


def seen() -> LocalMap:
    out = empty_map(5000)
    add_to_map(out, cloud(HERE), HERE, 15, False)
    return out


@pytest.mark.parametrize("course_rad", [0.0, 1.0, 2.4])
def test_a_scan_that_slid_and_turned_is_found_where_it_was_taken(course_rad: float) -> None:
    course = float(np.cos(course_rad)), float(np.sin(course_rad))
    off = HERE + np.array([0.2 * course[0], 0.2 * course[1], 0.1])
    best, found = best_near(seen(), cloud(HERE), off, course, 0.3, 0.3)
    assert found
    assert np.hypot(*(best - HERE)[:2]) < 0.03
    assert abs(best[2] - HERE[2]) < 0.015


def test_nothing_is_better_than_where_a_scan_was_taken() -> None:
    best, found = best_near(seen(), cloud(HERE), HERE, (1.0, 0.0), 0.3, 0.3)
    assert not found
    np.testing.assert_array_equal(best, HERE)


@pytest.mark.parametrize("course_rad", [0.0, 0.7, 1.5, 2.9])
def test_an_alignment_between_two_walls_holds_least_along_them(course_rad: float) -> None:
    """Also where what it says of turns and of positions hangs together."""
    c, s = np.cos(course_rad), np.sin(course_rad)
    turns = np.array([-s, c, 3.0]), np.array([-s, c, -1.0]), 0.1 * np.array([c, s, 0.0])
    hessian = sum(np.outer(row, row) for row in turns)
    x, y = weak_course(np.asarray(hessian))
    assert abs(x * c + y * s) == pytest.approx(1.0, abs=1e-9)


def test_few_scans_without_odometry_are_searched_for() -> None:
    """All of them were, by branch and bound, which took most of the time."""
    path = along([(1.5, 1.0), (8.5, 1.0), (8.5, 6.0), (2.5, 6.0), (1.5, 1.0)])
    log = replace(recording(furnished(), path, np.random.default_rng(4)), odometry=None, odometry_t_s=None)
    found = track(log, SlamConfig())
    assert found.searched < 0.1 * len(log)
    assert found.lost == 0
    truth = np.array([composed(path[0], pose) for pose in found.poses])
    assert np.hypot(*(truth - path)[:, :2].T).max() < 0.12
