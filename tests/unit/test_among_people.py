"""What our own controller does where people walk: nothing that its laser does not let it answer for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.controller_benchmark import CourseRequest, course_run_mission
from pilotage.experiments.course_driving import course_base
from pilotage.experiments.course_families import Driver, make_course_of
from pilotage.kernels.control.footprint import discs_clearance
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.stack.control.local.gap_horizon_config import GapHorizonConfig
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalLimits, LocalView

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
LIMITS = LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
DRIVE = Drive(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
MOUNT = Pose2(0.12, 0.0, 0.0)
DT_S = 0.05
THREE_QUARTERS = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 541)
WHOLE = np.linspace(-math.pi, math.pi, 721)


def driven(
    beams: FloatArray,
    half_m: float,
    walks_m_s: float,
    heading_rad: float = 0.0,
    begins_m: tuple[float, float] = (3.0, 0.02),
) -> FloatArray:
    """(80, 5) speed and turn rate commanded and driven, and the distance to somebody who walks towards -x."""
    config = LOCAL_CONTROLLERS.configure("gap-horizon", {"ground": {"movers": {"enabled": True}}}, "")
    controller = LOCAL_CONTROLLERS.entry("gap-horizon").factory(config, np.random.default_rng(1))
    walls = np.array([[-8.0, half_m, 8.0, half_m], [-8.0, -half_m, 8.0, -half_m]])
    state = (0.0, 0.0, heading_rad, 0.0, 0.0)
    rows = []
    for k in range(80):
        t_s = k * DT_S
        walker = np.array([[begins_m[0] - walks_m_s * t_s, begins_m[1], 0.25]])
        x, y, theta, v, w = state
        eye = x + MOUNT.x_m * math.cos(theta), y + MOUNT.x_m * math.sin(theta), theta + float(beams[0])
        ranges = fan_ranges(*eye, float(beams[1] - beams[0]), beams.shape[0], 20.0, walls, walker)
        pose, twist = Pose2(x, y, theta), Twist(v, w)
        view = LocalView(t_s, pose, twist, ranges, beams, MOUNT, 20.0, (6.0, 0.0), LIMITS, JACKAL)
        command = controller.step(view)
        state = advance(*state, command.v_m_s, command.w_rad_s, DT_S, DRIVE)
        away_m = math.hypot(walker[0, 0] - x, walker[0, 1] - y) - 0.25
        rows.append((command.v_m_s, command.w_rad_s, *state[3:], away_m))
    return np.array(rows)


def test_it_does_not_back_from_people_where_its_laser_does_not_look() -> None:
    meetings = [(0.5, 0.3), (0.5, 0.8), (0.7, 1.2), (1.0, 0.5)]
    assert [driven(THREE_QUARTERS, *meeting)[:, 0].min() for meeting in meetings] == [0.0] * len(meetings)
    # With eyes all around it does: whoever comes leaves it no better way.
    assert min(driven(WHOLE, *meeting)[:, 0].min() for meeting in meetings) < -0.3


@pytest.mark.parametrize("heading_rad", [1.2, -2.0])
def test_its_corners_come_nearer_to_nobody_whom_its_laser_does_not_see(heading_rad: float) -> None:
    """On arcs of at least the outer radius over cos 45 degrees; standing, it does not turn."""
    radius_m = math.hypot(0.254, 0.215) * math.sqrt(2.0)

    def swings(beams: FloatArray) -> float:
        # Somebody is known after four readings; what was turned until then has to end first.
        rows = driven(beams, 0.7, 0.8, heading_rad)[16:]
        return float((np.abs(rows[:, 3]) * radius_m - rows[:, 2]).max())

    assert swings(THREE_QUARTERS) < 0.05
    assert swings(WHOLE) > 0.3


def test_it_slows_sooner_for_who_runs_up_than_for_who_walks() -> None:
    """3.5 m before it, a runner is as near as a walker at less than 2.5 m: he may sprint at once."""

    def speed_m_s(walks_m_s: float, begins_m: float) -> float:
        rows = driven(WHOLE, 2.5, walks_m_s, begins_m=(begins_m, 1.7))
        rows = rows[: int(np.argmin(rows[:, 4]))]
        return float(rows[(rows[:, 4] > 2.8) & (rows[:, 4] < 3.6), 0].max())

    assert speed_m_s(1.0, 7.0) > 1.8
    assert speed_m_s(4.5, 11.0) <= 1.4


def test_it_slows_for_people_near_ahead_and_not_for_those_whom_it_leaves_behind() -> None:
    def fastest(begins_m: tuple[float, float], walks_m_s: float) -> float:
        rows = driven(THREE_QUARTERS, 4.0, walks_m_s, begins_m=begins_m)
        # Somebody is known after four readings; 2 m/s takes the robot two thirds of a second.
        near = rows[(rows[:, 4] < GapHorizonConfig().calm_m) & (np.arange(len(rows)) >= 4)]
        assert len(near) > 12
        return float(near[:, 0].max())

    assert fastest((-0.3, 1.6), 0.6) > 1.9
    assert fastest((2.0, 1.6), -1.2) <= GapHorizonConfig().calm_m_s


@pytest.mark.parametrize("half_m", [0.6, 1.5, 4.0])
def test_it_drives_on_once_who_walked_past_it_is_behind(half_m: float) -> None:
    """He walks through the place where it stands; 2.5 s on he is out of sight, and may be near for long."""
    rows = driven(THREE_QUARTERS, half_m, 0.9, begins_m=(1.6, 0.02))
    assert np.abs(rows[24:40, 2]).max() < 0.05, "it did not stand: the test shows nothing"
    assert rows[50:76, 2].max() > 0.5


@pytest.mark.parametrize("bearing_rad", [-0.6, -0.3, 0.3, 0.6])
def test_it_has_come_to_rest_before_who_runs_up_out_of_nothing_reaches_it(bearing_rad: float) -> None:
    """4.6 m before a robot of 2 m/s somebody appears who runs at it at 3.9 m/s, faster and faster."""
    config = LOCAL_CONTROLLERS.configure("gap-horizon", {"ground": {"movers": {"enabled": True}}}, "")
    controller = LOCAL_CONTROLLERS.entry("gap-horizon").factory(config, np.random.default_rng(1))
    walls = np.array([[-8, 6, 14, 6], [-8, -6, 14, -6], [14, -6, 14, 6], [-8, -6, -8, 6]], float)
    corners = np.array([[2.0, 5.0, 2.3, 5.0], [5.0, -5.0, 5.3, -5.0], [7.0, 5.2, 7.4, 5.2]])
    state, runner = (0.0, 0.0, 0.0, 2.0, 0.0), np.zeros((0, 3))
    for k in range(80):
        t_s = k * DT_S
        x, y, theta, v, w = state
        if t_s >= 1.0 and not runner.size:
            runner = np.array([[x + 4.6 * math.cos(bearing_rad), y + 4.6 * math.sin(bearing_rad), 0.25]])
        elif runner.size:
            towards = np.array([x + 0.1, y]) - runner[0, :2]
            runs_m_s = min(3.9 + 2.4 * (t_s - 1.0), 5.4)
            runner[0, :2] += runs_m_s * DT_S * towards / np.hypot(*towards)
        eye = x + MOUNT.x_m * math.cos(theta), y + MOUNT.x_m * math.sin(theta), theta - 0.75 * math.pi
        step_rad = float(THREE_QUARTERS[1] - THREE_QUARTERS[0])
        ranges = fan_ranges(
            *eye, step_rad, THREE_QUARTERS.shape[0], 20.0, np.vstack([walls, corners]), runner
        )
        pose, twist = Pose2(x, y, theta), Twist(v, w)
        view = LocalView(t_s, pose, twist, ranges, THREE_QUARTERS, MOUNT, 20.0, (12.0, 0.0), LIMITS, JACKAL)
        command = controller.step(view)
        state = advance(*state, command.v_m_s, command.w_rad_s, DT_S, DRIVE)
        if discs_clearance(*state[:3], JACKAL, runner) < 0.02:
            break
    assert discs_clearance(*state[:3], JACKAL, runner) < 0.02
    own_m_s = (
        discs_clearance(x, y, theta, JACKAL, runner) - discs_clearance(*state[:3], JACKAL, runner)
    ) / DT_S
    assert own_m_s < 0.01


def test_who_is_told_that_people_walk_keeps_the_other_settings_of_their_tracks() -> None:
    name = "gap-horizon"
    driver = Driver(Footprint.polygon(JACKAL), JACKAL, DifferentialDriveConfig(max_speed_m_s=2.0))
    request = CourseRequest(("crowd",), (name,))
    course = make_course_of("crowd", 0, 1, driver)
    assert course is not None
    assert course.people
    choice = course_run_mission(request, course_base(), course, 0, name).stack.local_controller
    assert choice is not None
    told = LOCAL_CONTROLLERS.configure(name, choice.parameters, name)
    assert isinstance(told, GapHorizonConfig)
    movers = told.ground.movers
    assert movers.enabled
    assert movers == GapHorizonConfig().ground.movers.model_copy(update={"enabled": True})
    assert movers.acceleration_lasts_s == pytest.approx(0.2)
