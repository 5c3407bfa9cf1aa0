"""Walls that are too short for a line are not asked for poses."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pilotage.kernels.lines.pose_hypotheses import _about, _long_enough
from pilotage.kernels.lines.wall_candidates import overlap_share

SMALL = st.floats(-4.0, 4.0)


@given(
    st.tuples(SMALL, SMALL, st.floats(-3.1, 3.1)),
    st.floats(0.05, 6.0),
    st.floats(0.01, 6.0),
    st.floats(-3.0, 3.0),
    st.floats(-0.4, 0.4),
    st.floats(-3.1, 3.1),
    st.floats(0.0, 0.5),
    st.floats(0.1, 1.0),
)
def test_no_wall_that_a_line_overlaps_is_left_out(
    pose: tuple[float, float, float],
    line_m: float,
    wall_m: float,
    along_m: float,
    askew_rad: float,
    alpha: float,
    slack: float,
    least: float,
) -> None:
    """Wherever the robot stands, a line that lies along a wall to within 23 degrees."""
    tangent = np.array([-math.sin(alpha), math.cos(alpha)])
    segment = np.concatenate([-0.5 * wall_m * tangent, 0.5 * wall_m * tangent])
    heading = alpha + 0.5 * math.pi + askew_rad
    half = 0.5 * line_m * np.array([math.cos(heading), math.sin(heading)])
    seen = np.array([along_m * tangent - half, along_m * tangent + half]) - pose[:2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    end = (seen @ np.array([[c, -s], [s, c]])).ravel()
    share = overlap_share(np.array(pose), np.zeros((3, 3)), np.zeros(3), end, alpha, segment, slack, 0.0)
    kept = _long_enough(segment[None, :], end, slack, least)
    assert len(kept) == 1 or share < least
    # It does sift: what is shorter by far is left out.
    assert not len(_long_enough(segment[None, :], end, 0.0, least)) or wall_m >= 0.89 * least * line_m


@given(st.lists(st.floats(-math.pi, math.pi), max_size=30), st.floats(-math.pi, math.pi), st.floats(0.0, 3.0))
def test_walls_at_the_right_angle_are_all_found_in_their_order(
    angles: list[float], angle: float, tolerance: float
) -> None:
    """Sorted by their angles, which go on beyond half a turn: as if each had been looked at."""
    all_rad = np.array(angles)
    by_angle = np.argsort(all_rad)
    found = _about(all_rad[by_angle], by_angle, angle, tolerance + 1e-9)
    off = np.abs((all_rad - angle + math.pi) % (2.0 * math.pi) - math.pi)
    assert set(np.flatnonzero(off <= tolerance)) <= set(found)
    assert (off[found] <= tolerance + 1e-6).all()
    assert (np.diff(found) > 0).all()
