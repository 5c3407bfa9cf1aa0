"""Beams that pass through occupied cells speak against a belief, wherever they end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.rasterize import rasterized
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.localization.walls_between import WallsBetween
from support.laser_rooms import ranges

ANGLES = np.linspace(-math.pi, math.pi, 60, endpoint=False)
EYE = np.zeros((1, 2))
SURE = np.diag([1e-4, 1e-4, 1e-4])
# Two rooms beside each other; the right one opens at its right end to where nobody has been.
ROOMS = np.array(
    [
        [0.0, 0.0, 12.0, 0.0],
        [0.0, 6.0, 12.0, 6.0],
        [0.0, 0.0, 0.0, 6.0],
        [6.0, 0.0, 6.0, 6.0],
    ]
)
BEYOND = np.array([[12.0, 0.0, 20.0, 0.0], [12.0, 6.0, 20.0, 6.0], [20.0, 0.0, 20.0, 6.0]])


def chart_of(walls: FloatArray) -> WorldMap:
    room = SegmentMap(walls, np.zeros((0, 3)), (-1.0, -1.0, 13.0, 7.0))
    grid: OccupancyGrid = rasterized(room, 0.05)
    return WorldMap("rooms", room.bounds_m, grid=grid)


def seen_from(pose: FloatArray) -> FloatArray:
    found = ranges(np.concatenate([ROOMS, BEYOND]), pose, ANGLES)
    return np.asarray(found[:, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]))


def scans_until_doubt(believed: FloatArray, true: FloatArray, cov: FloatArray = SURE, scans: int = 50) -> int:
    watch, seen = WallsBetween(chart_of(ROOMS), EYE), seen_from(true)
    for scan in range(1, scans + 1):
        if watch.speak_against(believed, cov, seen):
            return scan
    return 0


@pytest.mark.parametrize(
    ("believed", "true"),
    [
        ((3.0, 3.0, 0.4), (3.0, 3.0, 0.4)),
        ((3.05, 2.97, 0.42), (3.0, 3.0, 0.4)),  # a belief is never exact
        ((10.0, 3.0, 0.0), (10.0, 3.0, 0.0)),  # beams leave the map where it ends
        ((11.8, 3.0, 1.0), (11.8, 3.0, 1.0)),
        ((0.3, 3.0, 0.0), (0.3, 3.0, 0.0)),  # beside a wall
    ],
)
def test_a_belief_that_is_right_is_never_doubted(
    believed: tuple[float, float, float], true: tuple[float, float, float]
) -> None:
    assert scans_until_doubt(np.array(believed), np.array(true)) == 0


@pytest.mark.parametrize(
    ("believed", "true", "most"),
    [
        ((3.0, 3.0, 0.0), (10.0, 3.0, 0.0), 5),  # most of the scan ends where the map says nothing
        ((1.0, 1.0, 0.0), (5.0, 5.0, 0.0), 5),
        ((3.0, 3.0, 0.0), (3.0, 4.2, 0.0), 20),  # off by a little more than a metre
    ],
)
def test_a_belief_that_looks_through_walls_is_given_up(
    believed: tuple[float, float, float], true: tuple[float, float, float], most: int
) -> None:
    assert 0 < scans_until_doubt(np.array(believed), np.array(true)) <= most


def test_who_does_not_know_where_it_is_expects_nothing() -> None:
    unsure = np.diag([0.2, 0.2, 0.1])
    assert scans_until_doubt(np.array([3.0, 3.0, 0.0]), np.array([10.0, 3.0, 0.0]), unsure) == 0


def test_what_one_of_two_lasers_can_have_seen_passes_no_wall() -> None:
    """Scans joined of a laser at each end of a long body: one stands on the far side of a wall's end."""
    chart = chart_of(np.array([[0.0, 0.0, 12.0, 0.0], [6.0, 2.5, 6.0, 6.0]]))
    behind = np.column_stack([np.full(20, 8.0), np.linspace(3.0, 5.0, 20)]) - [5.5, 2.0]
    pose = np.array([5.5, 2.0, 0.0])
    alone, both = WallsBetween(chart, EYE), WallsBetween(chart, np.array([[0.0, 0.0], [1.5, 0.0]]))
    assert any(alone.speak_against(pose, SURE, behind) for _ in range(5))
    assert not any(both.speak_against(pose, SURE, behind) for _ in range(5))


def test_maps_of_lines_and_open_ground_have_no_cells_to_pass() -> None:
    lines = WorldMap(
        "lines", (0.0, 0.0, 12.0, 6.0), SegmentMap(ROOMS, np.zeros((0, 3)), (0.0, 0.0, 12.0, 6.0))
    )
    watch = WallsBetween(lines, EYE)
    seen = seen_from(np.array([10.0, 3.0, 0.0]))
    assert not any(watch.speak_against(np.array([3.0, 3.0, 0.0]), SURE, seen) for _ in range(20))
