"""What runs on the exploring robot: marks on its map, pose, potential field, the report's explorer."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, WheelSpeeds
from pilotage.maps.cell_map import CellMap, CellState, grown
from pilotage.missions.explorer import FirmwareConfig
from pilotage.replicas.cell_marks import CellMarks
from pilotage.replicas.heading_report import (
    EncoderGyroConfig,
    EncoderGyroFilter,
    EncoderMagnetometerConfig,
    EncoderMagnetometerFilter,
)
from pilotage.replicas.potential_field import PotentialField, PotentialFieldConfig
from pilotage.replicas.surround_check import SurroundCheck, SurroundCheckConfig
from pilotage.replicas.wheel_pose import WheelPose
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import InfraredReading, LineReading, Readings
from pilotage.stack.control.wheel_pursuit import pursue, wheel_speeds
from pilotage.stack.interface import StackStatus
from pilotage.stack.localization.gyro_bias import GyroBiasConfig, GyroBiasFilter
from pilotage.stack.localization.heading_filter import HeadingEstimate, HeadingFilter
from support.sheets import START, ToldOfSheet, sheet_knowledge, sheet_sensors, sheet_simulator

OBSTACLE, LINE, BORDER = CellState.OBSTACLE, CellState.LINE, CellState.BORDER
VISITED, EXPLORED, UNKNOWN = CellState.VISITED, CellState.EXPLORED, CellState.UNKNOWN


def beam(range_m: float, saturated: bool = False, name: str = "ir_front") -> Readings:
    return Readings(0.0, {name: InfraredReading(range_m, saturated)})


def test_a_return_is_an_obstacle_with_a_border_and_what_lies_before_it_is_explored() -> None:
    marks = CellMarks(sheet_knowledge())
    marks.step(beam(0.2), Pose2(0.25, 0.35, -0.2094))  # The sensor looks along x.
    states = marks.cells.states
    assert states[3, 5] == OBSTACLE
    assert states[3, 2] == VISITED
    assert states[3, 3] == EXPLORED
    assert np.array_equal(states == BORDER, grown(states == OBSTACLE) & (states != OBSTACLE))


@given(
    st.lists(
        st.tuples(st.floats(0, 1), st.floats(0, 0.8), st.floats(-3, 3), st.floats(0, 0.5), st.booleans()),
        max_size=12,
    )
)
def test_marks_never_fall_back_and_borders_are_those_of_the_map(
    beams: list[tuple[float, float, float, float, bool]],
) -> None:
    marks = CellMarks(sheet_knowledge())
    before = marks.cells.states
    for x, y, theta, length, saturated in beams:
        marks.step(beam(length, saturated), Pose2(x, y, theta))
        now = marks.cells.states
        assert (now <= before).all()
        before = now
    assert np.array_equal(CellMap(before).with_borders().states, before)


def test_the_margin_is_kept_by_all_but_features() -> None:
    marks = CellMarks(sheet_knowledge(), margin_cells=2)
    marks.step(Readings(0.0, {"line_left": LineReading(True)}), Pose2(0.05, 0.05, 0.0))
    marks.step(beam(0.25), Pose2(0.65, 0.35, 0.0))
    states = marks.cells.states
    assert marks.visited[0, 0]
    outside = np.ones(states.shape, dtype=np.bool_)
    outside[2:-2, 2:-2] = False
    assert set(np.unique(states[outside]).tolist()) == {OBSTACLE, LINE, UNKNOWN}
    assert marks.state(0, 5) is BORDER
    assert marks.state(-1, 5) is BORDER


def test_returns_beyond_the_reliable_range_are_no_obstacles() -> None:
    marks = CellMarks(sheet_knowledge())
    marks.step(beam(0.2, name="ir_left"), Pose2(0.35, 0.35, 0.0))
    assert not marks.cells.holds(OBSTACLE).any()


def test_the_firmware_marks_a_tape_at_its_centre() -> None:
    seen = Readings(0.0, {"line_left": LineReading(True)})
    for at_centre, column in ((False, 3), (True, 2)):
        marks = CellMarks(sheet_knowledge(firmware=FirmwareConfig(lines_at_centre=at_centre)))
        marks.step(seen, Pose2(0.28, 0.35, 0.0))
        assert marks.cells.states[3, column] == LINE


def drive(pose: WheelPose, command: WheelSpeeds, seconds: float) -> tuple[Pose2, Pose2]:
    sim = sheet_simulator(sheet_sensors(), RandomStreams(5))
    for step in range(round(seconds * 100)):
        found = pose.step(sim.step(command if step > 120 else WheelSpeeds(0.0, 0.0)))
    return found, sim.truth


def test_the_pose_follows_and_its_covariance_is_positive_definite() -> None:
    pose = WheelPose(sheet_knowledge())
    found, truth = drive(pose, WheelSpeeds(2.0, 2.4), 5.0)
    assert math.hypot(found.x_m - truth.x_m, found.y_m - truth.y_m) < 0.03
    assert np.linalg.eigvalsh(pose.belief.cov).min() > 0.0
    assert pose.belief.pose == found


def heading_error(magnetometer: MagnetometerConfig | None) -> float:
    sensors = sheet_sensors() | ({} if magnetometer is None else {"compass": magnetometer})
    knowledge = sheet_knowledge(fusion=False, magnetometer=magnetometer is not None, sensors=sensors)
    pose, sim = WheelPose(knowledge), sheet_simulator(sensors, RandomStreams(5))
    errors = []
    for step in range(6000):
        found = pose.step(sim.step(WheelSpeeds(-1.0, 1.0) if step % 2000 < 1500 else WheelSpeeds(0.0, 0.0)))
        errors.append(abs(wrap_to_pi(found.theta_rad - sim.truth.theta_rad)))
    return max(errors)


def test_a_magnetometer_ends_the_drift_unless_iron_bends_its_field() -> None:
    clean = MagnetometerConfig(hard_iron_ut=(0.0, 0.0), soft_iron_ratio=1.0, disturbance_ut=0.0)
    drift, corrected = heading_error(None), heading_error(clean)
    assert corrected < 0.5 * drift
    assert heading_error(MagnetometerConfig()) > 3.0 * corrected


def test_whole_rad_s_come_out_short() -> None:
    """Speeds of 2.0 to 2.1 rad/s are counted as 1 or 2, with the encoders' steps of 0.87 rad/s."""
    exact, _ = drive(WheelPose(sheet_knowledge(fusion=False)), WheelSpeeds(2.0, 2.0), 4.0)
    short = FirmwareConfig(truncated_wheel_speed=True)
    truncated, _ = drive(WheelPose(sheet_knowledge(fusion=False, firmware=short)), WheelSpeeds(2.0, 2.0), 4.0)
    share = (truncated.x_m - START.x_m) / (exact.x_m - START.x_m)
    assert 0.6 < share < 0.7  # The firmware's own 2 came out as 1.29.


@given(st.floats(-2.0, 2.0), st.floats(-20.0, 20.0))
def test_wheel_speeds_stay_within_their_limit_and_keep_the_curve(v: float, w: float) -> None:
    drive_config = sheet_knowledge().drive
    command = wheel_speeds(v, w, drive_config)
    assert max(abs(command.left_rad_s), abs(command.right_rad_s)) <= 3.0 + 1e-9
    left, right = v - 0.5 * w * 0.1421, v + 0.5 * w * 0.1421
    assert command.left_rad_s * right == pytest.approx(command.right_rad_s * left, abs=1e-9)


def test_the_field_turns_away_from_what_is_near_and_is_silent_otherwise() -> None:
    knowledge = sheet_knowledge()
    field = PotentialField(PotentialFieldConfig(), knowledge.sensors_of(InfraredConfig), knowledge.drive)
    pose = Pose2(0.0, 0.0, 0.0)
    field.sense(beam(0.2, name="ir_front"))
    assert field.command(pose, 1.0, 0.0) is None
    field.sense(beam(0.05, name="ir_left"))
    command = field.command(pose, 1.0, 0.0)
    assert command is not None
    assert command.left_rad_s > command.right_rad_s
    assert pursue(pose, 1.0, 0.0, knowledge.drive).left_rad_s > 0.0


def test_the_explorer_looks_north_first_and_says_when_nothing_is_left() -> None:
    explorer = ToldOfSheet().explorer(SurroundCheck, SurroundCheckConfig(margin_cells=0, fusion=False))
    marks = explorer._marks
    here = marks.cell_of(START.x_m, START.y_m)
    assert here is not None
    for row, column in ((1, 0), (0, 1)):
        marks._mark((here[0] + row, here[1] + column), CellState.EXPLORED)
    explorer._choose(0.0)
    assert explorer._goal == (here[0] + 1, here[1])
    marks._states[:] = CellState.VISITED
    explorer._goal = None
    explorer._choose(1.0)
    assert explorer.status == (StackStatus.ARRIVED, "no explored cell is left to visit")


def turned_by(heading: HeadingFilter | None, seconds: float = 60.0, **changes: Any) -> float:
    """Heading error in the end of a minute of turns and rests."""
    sensors = sheet_sensors() | {
        "compass": MagnetometerConfig(hard_iron_ut=(0.0, 0.0), soft_iron_ratio=1.0, disturbance_ut=0.0)
    }
    pose = WheelPose(sheet_knowledge(sensors=sensors, **changes), heading)
    sim = sheet_simulator(sensors, RandomStreams(5))
    for step in range(round(100 * seconds)):
        moving = step > 120 and step % 1000 < 800
        found = pose.step(sim.step(WheelSpeeds(-1.0, 1.0) if moving else WheelSpeeds(0.0, 0.0)))
    return abs(wrap_to_pi(found.theta_rad - sim.truth.theta_rad))


def test_each_heading_filter_can_be_chosen() -> None:
    at_start = HeadingEstimate(START.theta_rad, 1e-6)
    encoders = turned_by(None, fusion=False)
    by_default = turned_by(None)
    assert turned_by(EncoderGyroFilter(EncoderGyroConfig(), at_start)) == by_default
    trusting = EncoderGyroFilter(EncoderGyroConfig(process_var=50.0, measurement_var=0.01), at_start)
    assert turned_by(trusting) < by_default < encoders
    assert turned_by(GyroBiasFilter(GyroBiasConfig(), at_start)) < 0.5 * by_default
    compass = EncoderMagnetometerFilter(EncoderMagnetometerConfig(), at_start)
    assert turned_by(compass, magnetometer=True) < 0.5 * encoders


def test_a_heading_filter_may_use_the_encoders_alone() -> None:
    """It was told to need a magnetometer, which it makes no use of."""

    class ByWheels:
        USES: ClassVar[frozenset[str]] = frozenset()
        estimate = HeadingEstimate(START.theta_rad, 0.01)

        def step(self, turn: float | None, *_: object) -> HeadingEstimate:
            heading = wrap_to_pi(self.estimate.heading_rad + (turn or 0.0))
            self.estimate = HeadingEstimate(heading, 0.01)
            return self.estimate

    filtered: Any = ByWheels()
    found, truth = drive(WheelPose(sheet_knowledge(), filtered), WheelSpeeds(2.0, 2.4), 5.0)
    assert abs(wrap_to_pi(found.theta_rad - truth.theta_rad)) < 0.05


def test_a_heading_filter_that_would_never_be_asked_is_refused() -> None:
    at_start = HeadingEstimate(START.theta_rad, 1e-6)
    compass = EncoderMagnetometerFilter(EncoderMagnetometerConfig(), at_start)
    with pytest.raises(InputError, match=r"stack.navigator.fusion on"):
        WheelPose(sheet_knowledge(fusion=False), compass)
    with pytest.raises(InputError, match=r"stack.navigator.magnetometer on"):
        WheelPose(sheet_knowledge(), compass)


def test_the_fields_gains_and_ranges_decide() -> None:
    """A side sensor pushes within its range only, and by its gain against the goal's."""
    knowledge, pose = sheet_knowledge(), Pose2(0.0, 0.0, 0.0)

    def command(**changes: float) -> WheelSpeeds | None:
        sensors = knowledge.sensors_of(InfraredConfig)
        field = PotentialField(PotentialFieldConfig(**changes), sensors, knowledge.drive)
        field.sense(beam(0.05, name="ir_left"))
        return field.command(pose, 1.0, 0.0)

    assert command(trigger_side_m=0.04) is None
    strong, weak = command(), command(repulsion_mm=1.0)
    assert strong is not None
    assert weak is not None
    assert strong.left_rad_s > strong.right_rad_s + 1.0
    assert weak.left_rad_s == pytest.approx(weak.right_rad_s, abs=0.2)
