"""A robot that is stopped in a bend brakes along it, as whoever checked the command took for granted."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.control.arc_stop import ArcStop
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.knowledge import RobotKnowledge
from support.robots import told_of
from support.worlds import robot

DT_S = 0.1
WEAK = {"max_speed_m_s": 1.0, "max_acceleration_m_s2": 0.4}
ODOMETRY = {"odometry": WheelOdometryConfig(rate_hz=10.0)}
LASER = {"laser": LidarConfig(beams=720, field_of_view_rad=2.0 * math.pi, range_var_m2=0.0)}
NO_DISCS = np.zeros((0, 3))
FAR = WorldMap("far", (-50.0, -50.0, 50.0, 50.0))


def arc_stop_of(sheet: RobotKnowledge) -> ArcStop:
    """With brakes that nobody tells how they answer."""
    return ArcStop(sheet, Brakes(sheet))


def left(arc_stop: ArcStop, command: Twist) -> Twist:
    """What leaves for a command, of which it is told."""
    leaves = arc_stop.leaving(command)
    arc_stop.sent(leaves)
    return leaves


def stopped(motion: MotionConfig, command: Twist, odometry: bool = True, by_arc: bool = True) -> FloatArray:
    """(N, 3) poses from the stop of a robot that drove a command for long, until it stands."""
    sensors = ODOMETRY if odometry else {}
    sim = Simulator(World.of(FAR), [robot(sensors, motion=motion, start=Pose2(0.0, 0.0, 0.0))], DT_S)
    sheet = replace(told_of().robot, motion=motion, sensors=sensors, dt_s=DT_S)
    arc_stop, readings, poses = arc_stop_of(sheet), Readings(0.0, {}), []
    for step in range(200):
        arc_stop.take_in(readings)
        told = command if step < 60 else STOP
        readings = sim.step([left(arc_stop, told) if by_arc else told])[0]
        if step >= 60:
            poses.append(sim.bodies[0].pose.as_array())
    assert np.array_equal(poses[-1], poses[-2]), "it stands"
    return np.array(poses)


@pytest.mark.parametrize("delay_s", [0.0, 0.3])
@pytest.mark.parametrize("odometry", [True, False])
@pytest.mark.parametrize("kind", [DifferentialDriveConfig, OmnidirectionalConfig])
def test_it_keeps_its_radius_and_brakes_as_hard(
    kind: type[DifferentialDriveConfig], odometry: bool, delay_s: float
) -> None:
    """From 0.8 m/s it needs 0.8 m: straight on it came 0.4 m off its circle of a metre."""
    motion = kind(**WEAK, delay_s=delay_s)
    command = Twist(0.8, 0.8)

    def off_m(poses: FloatArray) -> float:
        """From the circle that it was on."""
        x, y, theta = poses[0]
        middle = x - math.sin(theta), y + math.cos(theta)
        return float(np.abs(np.hypot(*(poses[:, :2] - middle).T) - 1.0).max())

    along, straight = stopped(motion, command, odometry), stopped(motion, command, odometry, by_arc=False)
    assert off_m(straight) > 0.15
    assert off_m(along) < 0.01
    length_m = [float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()) for poses in (along, straight)]
    assert length_m[0] == pytest.approx(length_m[1], abs=0.01)


def test_sideways_it_keeps_its_direction() -> None:
    """Forwards and sideways each brake by as much: from (0.8, 0.2) it ended in a straight line."""
    poses = stopped(OmnidirectionalConfig(**WEAK), Twist(0.8, 0.0, 0.2))
    ways = np.diff(poses[:, :2], axis=0)
    ways = ways[np.hypot(*ways.T) > 1e-9]
    assert np.arctan2(ways[:, 1], ways[:, 0]) == pytest.approx(math.atan2(0.2, 0.8), abs=1e-9)


@pytest.mark.parametrize(
    "motion",
    [
        BicycleConfig(max_acceleration_m_s2=0.4),
        WheelDriveConfig(),
        DifferentialDriveConfig(max_acceleration_m_s2=20.0),
    ],
)
def test_who_leaves_no_arc_is_told_to_stop(motion: MotionConfig) -> None:
    arc_stop = arc_stop_of(replace(told_of().robot, motion=motion, sensors=ODOMETRY, dt_s=DT_S))
    for _ in range(20):
        left(arc_stop, Twist(0.5, 0.5))
    assert left(arc_stop, STOP) == STOP


def test_a_cars_wheels_are_reckoned_to_turn_as_fast_as_they_can() -> None:
    """From straight on to the tightest arc, as the car itself does, and on that while it brakes."""
    motion = BicycleConfig(max_acceleration_m_s2=0.4, max_steering_rate_rad_s=0.5, max_steering_rad=0.3)
    sim = Simulator(World.of(FAR), [robot(ODOMETRY, motion=motion, start=Pose2(0.0, 0.0, 0.0))], DT_S)
    arc_stop = arc_stop_of(replace(told_of().robot, motion=motion, sensors=ODOMETRY, dt_s=DT_S))
    told = [Twist(0.8, 0.0)] * 30 + [Twist(0.8, 2.0)] * 8 + [STOP] * 10
    for step, command in enumerate(told):
        expected = arc_stop.follows(command)
        left(arc_stop, command)
        sim.step([command])
        if step:
            found = sim.bodies[0].twist
            assert found.v_m_s == pytest.approx(expected.v_m_s, abs=1e-9)
            # A curvature's rate stands for that of a steering angle: all but exact near straight on.
            assert found.w_rad_s == pytest.approx(expected.w_rad_s, abs=0.03)
    assert expected.w_rad_s > 0.1


def test_a_turn_on_the_spot_stops_at_once() -> None:
    arc_stop = arc_stop_of(replace(told_of().robot, motion=DifferentialDriveConfig(**WEAK), dt_s=DT_S))
    for _ in range(20):
        left(arc_stop, Twist(0.0, 1.0))
    assert left(arc_stop, STOP) == STOP


def test_one_that_stands_against_something_is_soon_told_to_stand() -> None:
    """By what it was told it rolls at 0.8 m/s; its wheels stand."""
    motion = DifferentialDriveConfig(**WEAK)
    arc_stop = arc_stop_of(replace(told_of().robot, motion=motion, sensors=ODOMETRY, dt_s=DT_S))
    stands = {"odometry": OdometryIncrement(0.0, 0.0)}
    for step in range(60):
        arc_stop.take_in(Readings(0.1 * step, stands))
        left(arc_stop, Twist(0.8, 0.8))
    told = []
    for step in range(60, 63):
        arc_stop.take_in(Readings(0.1 * step, stands))
        told.append(left(arc_stop, STOP))
    assert told[0].v_m_s < 0.1
    assert told[2] == STOP


def test_one_that_rolls_is_not_let_turn_or_back_into_what_it_rolls_at() -> None:
    """A turn, or the way back, are free; the half metre that it rolls ahead meanwhile is not."""
    motion = DifferentialDriveConfig(**WEAK)
    sheet = replace(told_of().robot, motion=motion, sensors=LASER, dt_s=DT_S, footprint=Footprint.disc(0.3))

    def allowed(ahead_m: float) -> list[bool]:
        word = LastWord(sheet)
        for step in range(40):
            # It comes up to the wall as the laser shows it.
            here_m = ahead_m + 0.07 * (39 - step)
            word.take_in(Readings(0.1 * step, {"laser": LidarScan(wall(here_m))}))
            word.leaving(Twist(0.7, 0.0))
        back, turn = word.allows(Twist(-0.3, 0.0)), word.allows(Twist(0.0, 1.0))
        return [back, turn, word.allows(Twist(0.7, 0.0))]

    def wall(here_m: float) -> FloatArray:
        side = [here_m, -9.0, here_m, 9.0]
        sheet = LASER["laser"]
        return fan_ranges(
            0.0, 0.0, -math.pi, sheet.beam_step_rad, sheet.beams, 20.0, np.array([side]), NO_DISCS
        )

    assert allowed(3.0) == [True, True, True]
    assert allowed(0.8) == [False, False, False]


@pytest.mark.parametrize("truly", [{}, {"max_acceleration_m_s2": 0.2}])
def test_no_weak_brakes_carry_it_into_a_wall(tmp_path: Path, truly: dict[str, float]) -> None:
    """Navigator pose drives where it is told: into a wall in 9 of 40 drawn rooms, with 0.3 to 0.5 m/s2, and
    in 13 of 20 with half the brakes of its data sheet."""
    walls_m = [[0, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0], [5, 0, 5, 6]]
    hall = {"map": "hall", "bounds_m": [0, 0, 9, 6], "walls_m": walls_m}
    (tmp_path / "hall.yaml").write_text(yaml.safe_dump(hall))
    for heading_rad in (-3.0, 3.0):
        mission = {
            "mission": "into-a-wall",
            "world": {
                "map": str(tmp_path / "hall.yaml"),
                "start": {"x_m": 1.0, "y_m": 3.0, "theta_rad": heading_rad},
                "goal": {"x_m": 7.0, "y_m": 3.0, "theta_rad": 0.0},
            },
            "robot": {
                "footprint": {"radius_m": 0.25},
                "motion": {"name": "differential-drive", **WEAK},
                "true_motion": truly,
                "sensors": {
                    "odometry": {"name": "wheel-odometry", "rate_hz": 10},
                    "laser": {"name": "lidar", "rate_hz": 10, "beams": 720, "field_of_view_rad": 6.28},
                },
            },
            "task": "reach",
            "stack": {"navigator": {"name": "pose", "patience_s": 2.0}, "localizer": "dead-reckoning"},
            "run": {"dt_s": 0.1, "time_limit_s": 60, "seed": 1},
        }
        run = run_mission(mission_of(mission), save=False)
        assert run.metrics["collisions"] == 0
        assert "stuck" in str(run.metrics["reason"])


def test_weak_brakes_slow_down_before_a_wall_rather_than_plan_anew(tmp_path: Path) -> None:
    """Goal drove 1 m/s at a goal before a wall, was refused, planned the same anew thrice and backed out."""
    walls_m = [[0, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0]]
    hall = {"map": "hall", "bounds_m": [0, 0, 9, 6], "walls_m": walls_m}
    (tmp_path / "hall.yaml").write_text(yaml.safe_dump(hall))
    mission = {
        "mission": "before-a-wall",
        "world": {
            "map": str(tmp_path / "hall.yaml"),
            "start": {"x_m": 2.0, "y_m": 3.0},
            "goal": {"x_m": 8.2, "y_m": 3.3},
        },
        "robot": {
            "footprint": {"radius_m": 0.25},
            "motion": {"name": "differential-drive", **WEAK},
            "sensors": {
                "odometry": {"name": "wheel-odometry", "rate_hz": 10},
                "laser": {"name": "lidar", "rate_hz": 10, "beams": 360, "field_of_view_rad": 6.28},
            },
        },
        "task": "reach",
        "stack": {
            "navigator": "goal",
            "localizer": "laser",
            "planner": "theta-star",
            "smoother": "shortcut",
            "local_planner": {"name": "dubins", "speed_m_s": 1.0},
            "controller": "kanayama",
            "mapper": "obstacle-layer",
            "escape": "back-out",
        },
        "run": {"dt_s": 0.1, "time_limit_s": 60, "seed": 1},
    }
    metrics = run_mission(mission_of(mission), save=False).metrics
    assert metrics["success"]
    assert metrics["collisions"] == 0
    assert (metrics["replans"], metrics["escapes"]) == (0, 0)


def test_who_drives_ahead_and_aside_at_once_is_as_fast_as_it_is_told() -> None:
    """Each of its speeds has its own limit: together they are faster than either."""
    motion = OmnidirectionalConfig(**WEAK)
    arc_stop = arc_stop_of(replace(told_of().robot, motion=motion, sensors=ODOMETRY, dt_s=DT_S))
    arc_stop.take_in(Readings(0.0, {}))
    arc_stop.take_in(Readings(DT_S, {"odometry": OdometryIncrement(0.1, 0.0, 0.1)}))
    rolls_on = arc_stop.follows(STOP)
    assert (rolls_on.v_m_s, rolls_on.lateral_m_s) == pytest.approx((0.96, 0.96))


def test_what_comes_late_and_at_once_is_no_speed() -> None:
    """At 0.8 m/s it was taken for 1.6 m/s fast, and refused to turn where there was room for that."""
    sheet = replace(told_of().robot, motion=DifferentialDriveConfig(**WEAK), sensors=ODOMETRY, dt_s=DT_S)
    arc_stop, told = arc_stop_of(sheet), Twist(0.8, 0.4)
    for step in range(60):
        late = 2.0 if step == 59 else 0.0 if step == 58 else 1.0
        moved = {"odometry": OdometryIncrement(late * 0.08, late * 0.04)} if late else {}
        arc_stop.take_in(Readings(step * DT_S, moved))
        if step < 59:
            arc_stop.sent(told)
    rolls_on = arc_stop.follows(STOP)
    assert 0.8 < rolls_on.v_m_s <= 1.0
    faster = Twist(1.0, 0.5)
    assert arc_stop.follows(faster) == faster
