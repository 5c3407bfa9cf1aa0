"""Clearance along a plan: of the outline as it stands there, discs as well as polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.evaluation.driving import clearance_m
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint

WALL = SegmentMap(np.array([[-9.0, 1.0, 9.0, 1.0]]), np.zeros((0, 3)), (-9.0, -1.0, 9.0, 1.0))
CAR = Footprint.polygon(np.array([[0.5, 0.2], [-0.1, 0.2], [-0.1, -0.2], [0.5, -0.2]]))


@settings(max_examples=30, deadline=None)
@given(st.floats(-math.pi, math.pi))
def test_a_car_s_corner_counts_and_not_the_disc_around_it(theta: float) -> None:
    corners = CAR.points_m @ np.array(
        [[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]]
    )
    states = np.array([[x, 0.0, theta] for x in (-1.0, 0.0, 1.0)])
    assert clearance_m(states, WALL, CAR) == pytest.approx(1.0 - corners[:, 1].max(), abs=1e-12)


def test_a_disc_keeps_its_radius() -> None:
    states = np.array([[-1.0, 0.0, 0.0], [1.0, 0.4, 0.2]])
    assert clearance_m(states, WALL, Footprint.disc(0.3)) == pytest.approx(0.3, abs=1e-12)


def test_it_looks_between_states_and_turns_the_short_way() -> None:
    """From 3.0 to -3.0 rad, backwards along the wall: never across it."""
    states = np.array([[0.0, 0.6, 3.0], [-1.0, 0.6, -3.0]])
    through = Footprint.polygon(np.array([[0.6, 0.1], [-0.6, 0.1], [-0.6, -0.1], [0.6, -0.1]]))
    corner = 0.6 * math.sin(math.pi - 3.0) + 0.1 * math.cos(math.pi - 3.0)
    assert clearance_m(states, WALL, through) == pytest.approx(0.4 - corner, abs=1e-9)
    upright = np.array([[-1.0, 0.0, 0.5 * math.pi - 0.5], [0.0, 0.0, 0.5 * math.pi + 0.5]])
    assert clearance_m(upright, WALL, through) == pytest.approx(1.0 - math.hypot(0.6, 0.1), abs=1e-4)
