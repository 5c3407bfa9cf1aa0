"""Kanayama's law: on the reference it adds nothing, errors die out forwards and backwards."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Pose2, Twist
from pilotage.stack.control.kanayama import KanayamaConfig, KanayamaController, driven
from support.robots import told_of

DT_S = 0.1
small = st.floats(-0.1, 0.1)


def controller(**changes: float) -> KanayamaController:
    return KanayamaController(KanayamaConfig.model_validate(changes), told_of().robot)


@settings(max_examples=60)
@given(st.floats(-3.0, 3.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_on_the_reference_it_feeds_forward_alone(theta: float, v: float, w: float) -> None:
    pose = Pose2(2.0, -1.0, theta)
    control = controller().step(pose, driven(pose, Twist(v, w), DT_S), Twist(v, w))
    assert control.twist.v_m_s == pytest.approx(v, abs=1e-9)
    assert control.twist.w_rad_s == pytest.approx(w, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(small, small, st.floats(-0.3, 0.3), st.floats(0.2, 0.6), st.floats(-0.3, 0.3), st.booleans())
def test_errors_die_out_in_both_directions(
    along: float, across: float, turn: float, speed: float, w: float, backwards: bool
) -> None:
    law, feed = controller(), Twist(-speed if backwards else speed, w)
    reference = Pose2(0.0, 0.0, 0.4)
    pose = reference.compose(Pose2(along, across, turn))
    law.reset()
    for _ in range(round(8.0 / speed / DT_S)):
        reference = driven(reference, feed, DT_S)
        pose = driven(pose, law.step(pose, reference, feed).twist, DT_S)
    error = pose.inverse().compose(reference)
    assert math.hypot(error.x_m, error.y_m) < 0.01
    assert abs(wrap_to_pi(error.theta_rad)) < 0.03


@pytest.mark.parametrize(("speed", "dt_s"), [(2.0, 1.0), (1.0, 0.5), (0.04, 20.0)])
def test_errors_die_out_in_long_steps(speed: float, dt_s: float) -> None:
    """It threw a rover of 2 m/s at steps of 1 s from side to side, 170 m off its curve."""
    law = KanayamaController(KanayamaConfig(), replace(told_of().robot, dt_s=dt_s))
    reference, feed = Pose2(0.0, 0.0, 0.4), Twist(speed, 0.0)
    pose = reference.compose(Pose2(-0.1, 0.1, 0.1))
    for _ in range(60):
        reference = driven(reference, feed, dt_s)
        pose = driven(pose, law.step(pose, reference, feed).twist, dt_s)
    error = pose.inverse().compose(reference)
    assert math.hypot(error.x_m, error.y_m) < 0.01


def test_an_error_across_asks_for_the_other_turn_backwards() -> None:
    law, pose = controller(), Pose2(0.0, 0.0, 0.0)
    forwards = law.step(pose, Pose2(0.05, 0.1, 0.0), Twist(0.5, 0.0)).twist
    backwards = law.step(pose, Pose2(-0.05, 0.1, 0.0), Twist(-0.5, 0.0)).twist
    assert forwards.w_rad_s > 0.0
    assert backwards.w_rad_s == pytest.approx(-forwards.w_rad_s)


def test_at_rest_it_does_not_turn() -> None:
    control = controller().step(Pose2(0.0, 0.0, 0.0), Pose2(0.1, 0.1, 0.2), Twist(0.0, 0.0))
    assert control.twist.w_rad_s == 0.0
