"""The rover under a control law in the one simulator: move to a pose, its end, its gains."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pilotage.core.angles import wrap_to_pi
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2, Twist
from pilotage.evaluation.finished import RobotRun
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.experiments.oracles.parts import TrueLocalizer
from pilotage.experiments.oracles.truth import Truth
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sim.source import RobotSpec
from pilotage.stack.control.polar_pose import PolarPoseConfig, PolarPoseController
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.navigator.pose import PoseConfig, PoseNavigator
from support.worlds import Alone, alone

OPEN = WorldMap("open", (-1e6, -1e6, 1e6, 1e6))
OPEN_MAP = "world.map={map: open, bounds_m: [0, -10, 45000, 29990], walls_m: [[0, 0, 1, 1]]}"
ROVER = BicycleConfig(
    wheelbase_m=3.0,
    max_speed_m_s=0.04,
    max_steering_rad=1.57,
    max_steering_rate_rad_s=100.0,
    max_acceleration_m_s2=100.0,
)
SAMPLE_S = 10.0


def rover(start: Pose2, motion: BicycleConfig = ROVER, sample_s: float = SAMPLE_S) -> Alone:
    return alone(RobotSpec("rover", Footprint.disc(1.5), motion, {}, start, RandomStreams(0)), OPEN, sample_s)


def moved(
    goal: Pose2, start: Pose2, limit_s: float = 1e6, sample_s: float = SAMPLE_S, **gains: float
) -> tuple[StackStatus, float, Pose2]:
    """Drive to a pose: how it ended, when and where."""
    sim = rover(start, sample_s=sample_s)
    truth = Truth(OPEN, np.zeros((0, 4)), np.zeros((0, 3)), start, sim.body)
    known = RobotKnowledge(Footprint.disc(1.5), ROVER, {}, sample_s, RandomStreams(0))
    task = TaskKnowledge(Belief(start, 1e-8 * np.eye(3)), (Goal(goal.x_m, goal.y_m, goal.theta_rad),), 1e-3)
    parts = Parts(TrueLocalizer(truth), None, None, None, None, None, None, None)
    stack = PoseNavigator(PoseConfig(**gains), known, OPEN, task, parts, Journal())
    command = Twist(0.0, 0.0)
    while stack.status[0] is StackStatus.RUNNING and sim.t_s + sample_s <= limit_s:
        command = stack.step(sim.step(command))
    return stack.status[0], sim.t_s, sim.truth


class TestDrive:
    def test_a_circle_is_a_circle(self) -> None:
        """Constant twist: the exact arc at every step."""
        v, w = 0.04, 1e-4
        sim = rover(Pose2(0.0, 0.0, 0.0))
        for step in range(1, 10_001):
            sim.step(Twist(v, w))
            if step % 500 == 0:
                angle = w * sim.t_s
                x, y = v / w * math.sin(angle), v / w * (1.0 - math.cos(angle))
                assert (sim.truth.x_m, sim.truth.y_m) == pytest.approx((x, y), abs=1e-5)
                assert wrap_to_pi(sim.truth.theta_rad - angle) == pytest.approx(0.0, abs=1e-9)

    @pytest.mark.slow
    def test_the_reports_first_task(self) -> None:
        """338,190 s within 0.01 %; the end within 1.1 mm and 1e-3 rad.

        A command is held for a step: the mission's 5 s is near enough to the continuous law.
        """
        finished = simulate(load_mission("gale-pose", [OPEN_MAP])).finished
        robot: RobotRun = finished.robots[0]
        assert robot.arrived
        assert finished.duration_s == pytest.approx(338_190.0, rel=1e-4)
        x, y = robot.trace["true_x_m"], robot.trace["true_y_m"]
        away = np.hypot(x - 33070.0, y - 19010.0)
        assert away[-1] <= 1.1e-3
        assert abs(wrap_to_pi(float(robot.trace["true_theta_rad"][-1]) - math.pi)) < 1e-3
        assert np.all(away[:-1] > 1e-3), "the first sample within a millimetre ends it"

    def test_gains_that_arrive_within_few_samples(self) -> None:
        """Nearly there with each sample: the one that ends it is far within the tolerance."""
        goal = Pose2(2.0, 0.4, 0.2)
        status, _, end = moved(
            goal,
            Pose2(0.0, 0.0, 0.1),
            limit_s=1e4,
            rho_gain_per_s=0.05,
            alpha_gain_per_s=0.08,
            beta_gain_per_s=-0.001,
        )
        assert status is StackStatus.ARRIVED
        assert math.hypot(end.x_m - goal.x_m, end.y_m - goal.y_m) <= 1e-3

    @given(st.floats(5.0, 500.0), st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
    @settings(max_examples=30)
    def test_a_pose_ahead_that_looks_ahead_is_reached(
        self, away_m: float, bearing: float, alpha: float, beta: float
    ) -> None:
        """Goal in front, and its heading away from the rover; turned farther, the law may circle."""
        theta = wrap_to_pi(bearing - alpha)
        goal = Pose2(away_m * math.cos(bearing), away_m * math.sin(bearing), wrap_to_pi(beta + bearing))
        status, _, _ = moved(goal, Pose2(0.0, 0.0, theta), limit_s=1e5)
        assert status is StackStatus.ARRIVED

    def test_a_time_limit_ends_it(self) -> None:
        finished = simulate(load_mission("gale-pose", [OPEN_MAP, "run.time_limit_s=93"])).finished
        assert not finished.robots[0].arrived
        assert finished.ending == "time limit of 93 s reached"
        # The step in which the time is over is driven to its end.
        assert finished.duration_s == 95.0

    def test_already_there(self) -> None:
        status, t_s, _ = moved(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0))
        assert status is StackStatus.ARRIVED
        assert t_s == SAMPLE_S


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
            PolarPoseConfig.model_validate({"rho_gain_per_s": 1.3e-3, gain: value})

    def test_gains_that_are_not_given_follow_from_those_that_are_or_from_the_robot(self) -> None:
        """A robot on a floor had the rover's: a millimetre a second."""
        report = (1.3e-3, 1.5e-3, -1.9e-3)
        for one in ({"rho_gain_per_s": 1.3e-3}, {"alpha_gain_per_s": 1.5e-3}, {"beta_gain_per_s": -1.9e-3}):
            assert PolarPoseConfig.model_validate(one).gains_per_s(ROVER, 10.0) == pytest.approx(report)
        with pytest.raises(ValidationError, match="K_alpha > K_rho"):
            PolarPoseConfig(alpha_gain_per_s=1e-3, beta_gain_per_s=-1.9e-3)
        base = DifferentialDriveConfig(max_speed_m_s=1.0, max_turn_rate_rad_s=2.0)
        rho, alpha, beta = PolarPoseConfig().gains_per_s(base, 0.1)
        assert math.pi * (alpha - beta) <= 2.0 + 1e-9
        assert rho * 1.0 <= base.braking_m_s2 + 1e-9
        assert rho > 0.1
        assert PolarPoseConfig().gains_per_s(ROVER, 10.0)[0] == pytest.approx(0.01)

    def test_the_steering_limit_is_the_bodys(self) -> None:
        """The law may ask for more; what drives keeps tan(gamma) = L w / v within its limit."""
        stiff = ROVER.model_copy(update={"max_steering_rad": 0.1})
        gains = PolarPoseConfig(rho_gain_per_s=1.3e-3, alpha_gain_per_s=1.0, beta_gain_per_s=-1.9e-3)
        law = PolarPoseController(gains, Pose2(0.0, 0.0, 0.0), stiff, 1.0)
        for theta in np.linspace(-3.0, 3.0, 13):
            sim = rover(Pose2(-50.0, 20.0, float(theta)), stiff, sample_s=1.0)
            for _ in range(3):
                here = sim.truth
                sim.step(law.command(here.x_m, here.y_m, here.theta_rad))
                twist = sim.body.twist
                steering = math.atan2(3.0 * twist.w_rad_s, twist.v_m_s)
                assert abs(steering) <= 0.1 + 1e-9
