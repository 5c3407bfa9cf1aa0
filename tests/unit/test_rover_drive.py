"""The rover under a control law: move to a pose, its end, its gains."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Pose2, Twist
from pilotage.sim.rover_drive import SampledDrive, drive
from pilotage.stack.control.polar_pose import PolarPoseConfig, PolarPoseController


def polar(goal: Pose2, **parameters: float) -> PolarPoseController:
    return PolarPoseController(PolarPoseConfig(**parameters), goal)


def driven(
    controller: PolarPoseController, start: Pose2, sample_s: float = 10.0, limit_s: float = 1e6
) -> SampledDrive:
    return drive(controller.command, controller.distance_m, start, sample_s, 1e-3, limit_s)


class TestDrive:
    def test_a_circle_is_a_circle(self) -> None:
        """Constant twist: the exact arc, to the integrator's tolerance, at every sample."""
        v, w = 0.04, 1e-4
        way = drive(lambda *_: Twist(v, w), lambda *_: 1.0, Pose2(0.0, 0.0, 0.0), 10.0, 1e-3, 1e5)
        assert not way.arrived
        assert way.t_s[-1] == 1e5
        assert np.all(np.diff(way.t_s) == 10.0)
        x, y = v / w * np.sin(w * way.t_s), v / w * (1.0 - np.cos(w * way.t_s))
        assert way.poses == pytest.approx(np.column_stack([x, y, w * way.t_s]), abs=1e-5)

    def test_the_reports_first_task(self) -> None:
        """338,190 s within 0.01 %; the end within 1.1 mm and 1e-3 rad."""
        goal = Pose2(33070.0, 19010.0, -math.pi)
        way = driven(polar(goal), Pose2(42380.0, 11590.0, math.pi / 2))
        assert way.arrived
        assert way.t_s[-1] == pytest.approx(338_190.0, rel=1e-4)
        x, y, theta = way.poses[-1]
        assert math.hypot(x - 33070.001, y - 19010.0) <= 1.1e-3
        assert theta == pytest.approx(math.pi, abs=1e-3)
        away = np.hypot(way.poses[:, 0] - goal.x_m, way.poses[:, 1] - goal.y_m)
        assert np.all(away[:-1] > 1e-3), "the first sample within a millimetre ends it"

    def test_gains_that_arrive_between_two_samples(self) -> None:
        """A hundredfold nearer with each sample: the sample that ends it is far within the tolerance."""
        goal = Pose2(100.0, 40.0, 1.0)
        fast = polar(goal, rho_gain_per_s=1.0, alpha_gain_per_s=1.5, beta_gain_per_s=-0.001)
        way = driven(fast, Pose2(0.0, 0.0, 0.0), limit_s=1e4)
        assert way.arrived
        assert fast.distance_m(way.poses[-1, 0], way.poses[-1, 1]) <= 1e-3

    @given(st.floats(5.0, 500.0), st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
    @settings(max_examples=30)
    def test_a_pose_ahead_that_looks_ahead_is_reached(
        self, away_m: float, bearing: float, alpha: float, beta: float
    ) -> None:
        """Goal in front, and its heading away from the rover; turned farther, the law may circle."""
        theta = math.remainder(bearing - alpha, 2 * math.pi)
        goal = Pose2(away_m * math.cos(bearing), away_m * math.sin(bearing), wrap_to_pi(beta + bearing))
        assert driven(polar(goal), Pose2(0.0, 0.0, theta), limit_s=1e5).arrived

    def test_a_time_limit_ends_it(self) -> None:
        way = driven(polar(Pose2(100.0, 0.0, 0.0)), Pose2(0.0, 0.0, 0.0), limit_s=95.0)
        assert not way.arrived
        assert way.t_s[-1] == 90.0

    def test_already_there(self) -> None:
        way = driven(polar(Pose2(0.0, 0.0, 0.0)), Pose2(0.0, 0.0, 0.0))
        assert way.arrived
        assert len(way.t_s) == 1


class TestPolarPose:
    @pytest.mark.parametrize(
        ("gain", "value"),
        [
            ("rho_gain_per_s", 0.0),
            ("rho_gain_per_s", math.nan),
            ("beta_gain_per_s", 0.0),
            ("beta_gain_per_s", 1e-3),
            ("alpha_gain_per_s", 1.3e-3),
            ("alpha_gain_per_s", math.nan),
        ],
    )
    def test_gains_that_cannot_be_stable_are_refused(self, gain: str, value: float) -> None:
        with pytest.raises(ValidationError, match=rf"{gain}[\s\S]*(stable|finite)"):
            PolarPoseConfig(**{gain: value})

    def test_a_steering_limit_holds(self) -> None:
        controller = polar(Pose2(0.0, 0.0, 0.0), max_steering_rad=0.1, alpha_gain_per_s=1.0)
        for theta in np.linspace(-3.0, 3.0, 13):
            twist = controller.command(-50.0, 20.0, float(theta))
            assert abs(controller.steering_rad(twist)) <= 0.1 + 1e-12
