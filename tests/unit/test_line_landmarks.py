"""Lines among points, crossings of tapes, and cells made of both."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.kernels.lines import landmarks as line_landmarks
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.stack.exploration.sheet_features import enclosed
from pilotage.stack.localization.line_crossings import CrossingDetector


def test_a_wall_is_found_among_outliers() -> None:
    rng = np.random.default_rng(5)
    along = rng.uniform(0.0, 0.3, 60)
    angle = 0.7
    normal, tangent = (
        np.array([math.cos(angle), math.sin(angle)]),
        np.array([-math.sin(angle), math.cos(angle)]),
    )
    wall = np.array([0.4, 0.5]) + along[:, None] * tangent + 0.002 * rng.normal(size=(60, 1)) * normal
    points = np.zeros((100, 4))
    points[:60, :2] = wall
    points[60:, :2] = rng.uniform(0.0, 1.5, size=(40, 2))
    points[:, 2:] = -normal
    line, extent = np.zeros(4), np.zeros(2)
    found = line_landmarks.find_line(
        points, np.full(100, 0.002), np.arange(100), rng.random((200, 2)), 0.003, 0.05, 0.05, 12, line, extent
    )
    assert found >= 55
    assert abs(math.remainder(line[0] - angle, 2.0 * math.pi)) < 0.02
    offset = normal @ (line[2:] - np.array([0.4, 0.5])) + line[1]
    assert abs(offset) < 0.002
    assert 0.26 < extent[1] - extent[0] < 0.34


def test_points_seen_from_the_other_side_do_not_belong() -> None:
    line, extent = np.array([[0.0, 0.0, 0.5, 0.5]]), np.array([[-0.2, 0.2]])
    points = np.array([[0.501, 0.5, -1.0, 0.0], [0.501, 0.5, 1.0, 0.0], [0.501, 0.9, -1.0, 0.0]])
    owner = np.zeros(3, np.int64)
    line_landmarks.associate(
        points,
        np.full(3, 0.002),
        3,
        line,
        extent,
        np.ones(1, np.bool_),
        np.full(3, 0.003),
        3.5,
        0.06,
        owner,
    )
    assert owner.tolist() == [0, -1, -1]


@pytest.mark.parametrize("slant", [0.0, 0.6, -0.9])
def test_a_crossings_middle_lies_on_the_tape(slant: float) -> None:
    """However slanted, whatever side it comes from."""
    detector = CrossingDetector(0.015, (1.8, 1.8), edge_is_dark=True)
    found = []
    for t in np.arange(-0.05, 0.05, 0.001):
        x, y = 0.9 + t * math.cos(slant), 0.7 + t * math.sin(slant)
        crossing = detector.step(abs(x - 0.9) < 0.0075, (float(x), float(y)), 0.005)
        if crossing is not None:
            found.append(crossing)
    assert len(found) == 1
    assert not found[0].edge
    assert abs(found[0].at[0] - 0.9) < 0.0011


def test_turning_back_on_a_tape_is_no_crossing_and_the_edge_counts_both_ways() -> None:
    detector = CrossingDetector(0.015, (1.8, 1.8), edge_is_dark=True)
    way = [*np.arange(0.0, 0.095, 0.001), *np.arange(0.094, 0.0, -0.001)]
    assert all(detector.step(abs(t - 0.1) < 0.0075, (0.8 + float(t), 0.7), 0.005) is None for t in way)
    detector = CrossingDetector(0.015, (1.8, 1.8), edge_is_dark=True)
    way = [*np.arange(1.75, 1.82, 0.001), *np.arange(1.82, 1.75, -0.001)]
    found = [detector.step(t > 1.8, (float(t), 0.7), 0.005) for t in way]
    edges = [crossing for crossing in found if crossing is not None]
    assert len(edges) == 2
    assert all(edge.edge and abs(edge.at[0] - 1.8) < 0.001 for edge in edges)


def test_the_inside_of_a_box_is_enclosed_and_a_nook_is_not() -> None:
    states = np.full((9, 9), CellState.EXPLORED, np.uint8)
    states[2:7, 2:7] = CellState.OBSTACLE
    states[3:6, 3:6] = CellState.UNKNOWN
    assert enclosed(CellMap(states)).sum() == 9
    states[4, 2] = CellState.EXPLORED
    assert not enclosed(CellMap(states)).any()
