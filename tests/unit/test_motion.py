"""Motion and measurement equations: their Jacobians against central differences, their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters.ekf import predict_sideways
from pilotage.kernels.geometry.motion import exact_arc, sideways
from pilotage.models.odometry import OdometryModel, chord
from support.models import move, move_jacobians, range_bearing

angle = st.floats(-3.1, 3.1)
place = st.floats(-20.0, 20.0)
STEP = 1e-6


def difference(after: FloatArray, before: FloatArray) -> FloatArray:
    """Difference of two vectors whose last entry is an angle."""
    out = after - before
    out[-1] = wrap_to_pi(float(out[-1]))
    return out


@settings(max_examples=200, deadline=None)
@given(place, place, angle, st.floats(-2.0, 2.0), st.floats(-2.5, 2.5), st.sampled_from(list(OdometryModel)))
def test_odometry_jacobians(
    x: float, y: float, theta: float, distance: float, turn: float, model: OdometryModel
) -> None:
    pose = Pose2(x, y, theta)
    F, G = move_jacobians(pose, distance, turn, model)
    for i in range(3):
        shift = np.eye(3)[i] * STEP
        ahead = move(Pose2.from_array(pose.as_array() + shift), distance, turn, model).as_array()
        behind = move(Pose2.from_array(pose.as_array() - shift), distance, turn, model).as_array()
        assert difference(ahead, behind) / (2 * STEP) == pytest.approx(F[:, i], abs=2e-6)
    for j, (dd, da) in enumerate(((STEP, 0.0), (0.0, STEP))):
        ahead = move(pose, distance + dd, turn + da, model).as_array()
        behind = move(pose, distance - dd, turn - da, model).as_array()
        assert difference(ahead, behind) / (2 * STEP) == pytest.approx(G[:, j], abs=2e-6)


@given(angle, st.floats(0.01, 5.0), st.floats(0.05, 3.0))
def test_exact_arc_lies_on_its_circle(theta: float, distance: float, turn: float) -> None:
    radius = distance / turn
    centre = np.array([-radius * math.sin(theta), radius * math.cos(theta)])
    end = move(Pose2(0.0, 0.0, theta), distance, turn, OdometryModel.EXACT_ARC)
    assert math.hypot(end.x_m - centre[0], end.y_m - centre[1]) == pytest.approx(radius, rel=1e-9)


@given(angle, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 0.9))
def test_exact_arc_can_be_driven_in_two_pieces(
    theta: float, distance: float, turn: float, part: float
) -> None:
    start = Pose2(1.0, -2.0, theta)
    whole = move(start, distance, turn, OdometryModel.EXACT_ARC)
    half = move(start, part * distance, part * turn, OdometryModel.EXACT_ARC)
    end = move(half, (1 - part) * distance, (1 - part) * turn, OdometryModel.EXACT_ARC)
    assert difference(end.as_array(), whole.as_array()) == pytest.approx([0, 0, 0], abs=1e-9)


@given(angle, st.floats(-1.0, 1.0), st.floats(-0.2, 0.2))
def test_mid_angle_is_the_arc_to_third_order(theta: float, distance: float, turn: float) -> None:
    start = Pose2(0.0, 0.0, theta)
    exact = move(start, distance, turn, OdometryModel.EXACT_ARC)
    report = move(start, distance, turn, OdometryModel.MID_ANGLE)
    gap = math.hypot(exact.x_m - report.x_m, exact.y_m - report.y_m)
    assert gap <= abs(distance) * turn**2 / 24 + 1e-12


@settings(max_examples=200, deadline=None)
@given(place, place, angle, place, place, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), angle)
def test_range_bearing_jacobian(
    x: float, y: float, theta: float, mx: float, my: float, ox: float, oy: float, look: float
) -> None:
    pose, landmark = Pose2(x, y, theta), np.array([mx, my])
    mount = np.array([ox, oy, look])
    if math.hypot(mx - x, my - y) < 1.5:
        return
    z, H = range_bearing(pose, landmark, mount)
    assert -math.pi <= z[1] < math.pi
    for i in range(3):
        shift = np.eye(3)[i] * STEP
        ahead, _ = range_bearing(Pose2.from_array(pose.as_array() + shift), landmark, mount)
        behind, _ = range_bearing(Pose2.from_array(pose.as_array() - shift), landmark, mount)
        assert difference(ahead, behind) / (2 * STEP) == pytest.approx(H[:, i], abs=2e-5)


def test_bearing_is_measured_from_the_heading_counter_clockwise() -> None:
    z, _ = range_bearing(Pose2(0.0, 0.0, math.pi / 2), np.array([-2.0, 0.0]), np.zeros(3))
    assert z == pytest.approx([2.0, math.pi / 2])


def test_landmark_on_the_sensor_is_refused() -> None:
    with pytest.raises(ValueError, match="undefined"):
        range_bearing(Pose2(1.0, 1.0, 0.0), np.array([1.0, 1.0]), np.zeros(3))


@given(angle, st.floats(-2.0, 2.0), st.floats(-2.5, 2.5), st.floats(-2.0, 2.0))
def test_an_arc_with_a_drift_to_the_left_is_what_small_steps_add_up_to(
    theta: float, distance: float, turn: float, lateral: float
) -> None:
    x, y, heading = exact_arc(1.0, -2.0, theta, distance, turn)
    dx, dy = sideways(heading, lateral, turn, True)
    parts = 2000
    headings = theta + turn * (np.arange(parts) + 0.5) / parts
    forward, left = distance / parts, lateral / parts
    driven_x = (forward * np.cos(headings) - left * np.sin(headings)).sum()
    driven_y = (forward * np.sin(headings) + left * np.cos(headings)).sum()
    assert [x + dx, y + dy] == pytest.approx([1.0 + driven_x, -2.0 + driven_y], abs=1e-5)
    length, aside = chord(distance, turn, lateral)
    assert [length * math.cos(theta + aside), length * math.sin(theta + aside)] == pytest.approx(
        [driven_x, driven_y], abs=1e-5
    )


@given(angle, st.floats(-2.5, 2.5), st.floats(-2.0, 2.0), st.booleans())
def test_a_drift_to_the_left_moves_the_covariance_by_its_jacobians(
    theta: float, turn: float, lateral: float, exact: bool
) -> None:
    root = np.random.default_rng(4).normal(size=(5, 5))
    before, variance = root @ root.T, 0.3

    def moved(state: FloatArray, left: float) -> FloatArray:
        out = state.copy()
        out[:2] += sideways(out[2], left, turn, exact)
        return out

    state = np.array([1.0, -2.0, theta, 0.3, 0.4])
    F, G = np.empty((5, 5)), (moved(state, lateral + STEP) - moved(state, lateral - STEP)) / (2 * STEP)
    for i, shift in enumerate(np.eye(5) * STEP):
        F[:, i] = (moved(state + shift, lateral) - moved(state - shift, lateral)) / (2 * STEP)
    there, cov = state.copy(), before.copy()
    predict_sideways(there, cov, lateral, turn, variance, exact)
    assert there == pytest.approx(moved(state, lateral))
    assert cov == pytest.approx(F @ before @ F.T + variance * np.outer(G, G), abs=1e-5)
    assert (cov == cov.T).all()
