"""A robot with several lidars: all that runs on it takes them as one."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.kernels.scans.rays import narrow_fan
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.joint_lidar import joint_lidar, places_of_lasers_m
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.scan_fit import ScanFit
from pilotage.stack.mapping.obstacle_layer import ObstacleLayer, ObstacleLayerConfig
from pilotage.stack.perception.joint_scan import JointScan, with_joint_lidar

TWO = """
extends: {mission}
robot:
  sensors:
    lidar: null
    front: {{name: lidar, rate_hz: 10, beams: 240, field_of_view_rad: 3.4, mount: {{x_m: 0.2}}}}
    back: {{name: lidar, rate_hz: 10, beams: 240, field_of_view_rad: 3.4,
           mount: {{x_m: -0.2, theta_rad: 3.14159}}}}
"""
CORNERS: dict[str, SensorConfig] = {
    "front": LidarConfig(beams=541, mount=Mount(x_m=0.3, y_m=0.2, theta_rad=0.25 * math.pi)),
    "back": LidarConfig(beams=541, mount=Mount(x_m=-0.3, y_m=-0.2, theta_rad=-0.75 * math.pi)),
}
# A long hall, seen aslant to its end, and a post in it.
HALL = np.array(
    [[-9.0, -1.0, 18.0, -1.0], [18.0, -1.0, 18.0, 1.4], [18.0, 1.4, -9.0, 1.4], [-9.0, 1.4, -9.0, -1.0]]
)
POST = np.array([[3.0, 0.5, 0.05]])


def seen(sheet: LidarConfig, body: Pose2, walls: FloatArray = HALL, posts: FloatArray = POST) -> FloatArray:
    """What a laser without noise reads in the hall, or among other walls."""
    at = body.compose(sheet.mount.pose)
    angles, out = sheet.beam_angles_rad(), np.full(sheet.beams, sheet.max_range_m)
    turned = angles - angles[0]
    first_rad = at.theta_rad + float(angles[0])
    fan = 0.0, sheet.beam_step_rad, np.cos(turned), np.sin(turned), sheet.max_range_m
    narrow_fan(out, at.x_m, at.y_m, first_rad, fan, walls, posts)
    return out


def joined(
    sensors: dict[str, SensorConfig], body: Pose2, walls: FloatArray = HALL, posts: FloatArray = POST
) -> tuple[JointScan, FloatArray]:
    """The joint scan in the hall, or among other walls."""
    join = JointScan.of(sensors)
    assert join is not None
    scans = {
        name: LidarScan(seen(sheet, body, walls, posts))
        for name, sheet in sensors.items()
        if isinstance(sheet, LidarConfig)
    }
    scan = join.add(Readings(0.1, scans)).by_sensor[join.name]
    assert isinstance(scan, LidarScan)
    return join, scan.ranges_m


def mission_of(tmp_path: Path, base: str, *overrides: str) -> Mission:
    """A shipped mission whose robot has two lidars instead of one."""
    file = tmp_path / "two.yaml"
    file.write_text(TWO.format(mission=base))
    return load_mission(str(file), overrides=list(overrides), seed=1)


@pytest.mark.parametrize("turn_rad", [0.0, 0.03, 0.7, 2.5])
def test_a_joint_scan_is_what_a_laser_between_them_would_see(turn_rad: float) -> None:
    join, ranges_m = joined(CORNERS, Pose2(0.0, 0.0, turn_rad))
    truth_m = seen(join.sheet, Pose2(0.0, 0.0, turn_rad))
    told = ~np.isnan(ranges_m)
    assert told.mean() > 0.98
    off_m = np.abs(ranges_m - truth_m)[told]
    # Walls aslant to the very end: beams that took the nearest return's range would be decimetres off there.
    assert np.percentile(off_m, 97) < 0.002
    angles = join.sheet.beam_angles_rad() + join.sheet.mount.theta_rad + turn_rad
    towards = np.abs(np.remainder(angles - math.atan2(0.5, 3.0) + math.pi, 2 * math.pi) - math.pi) < 0.01
    assert np.nanmin(ranges_m[towards]) == pytest.approx(math.hypot(3.0, 0.5) - 0.05, abs=0.02)


def test_where_no_laser_looks_nothing_is_told() -> None:
    narrow: dict[str, SensorConfig] = {
        "front": LidarConfig(beams=91, field_of_view_rad=2.0),
        "back": LidarConfig(beams=91, field_of_view_rad=2.0, mount=Mount(theta_rad=math.pi)),
    }
    join, ranges_m = joined(narrow, Pose2(0.0, 0.0, 0.0))
    looks = (
        np.remainder(join.sheet.beam_angles_rad() + join.sheet.mount.theta_rad + math.pi, 2 * math.pi)
        - math.pi
    )
    sideways = np.abs(np.abs(looks) - 0.5 * math.pi) < 0.5 * math.pi - 1.05
    assert sideways.any()
    assert np.isnan(ranges_m[sideways]).all()
    assert not np.isnan(ranges_m[np.abs(looks) < 0.95]).any()


@pytest.mark.parametrize("lasers", [2, 3, 4])
@pytest.mark.parametrize("short_rad", [0.0, 1.6e-3, 2.65e-6, 1e-12, -1e-12, -1e-5, -0.1])
@pytest.mark.parametrize("turned_rad", [0.0, 0.3, -2.0])
def test_views_that_meet_go_all_around(lasers: int, short_rad: float, turned_rad: float) -> None:
    """Of two half circles, each of 3.14159 rad, the one in front was not among the beams of both."""
    view_rad = 2.0 * math.pi / lasers - short_rad
    corners: dict[str, SensorConfig] = {
        f"laser{k}": LidarConfig(
            beams=180,
            field_of_view_rad=view_rad,
            mount=Mount(x_m=0.1 * k, theta_rad=wrap_to_pi(turned_rad + 2.0 * math.pi * k / lasers)),
        )
        for k in range(lasers)
    }
    sheet = joint_lidar(corners)
    assert sheet is not None
    assert sheet.field_of_view_rad == 2.0 * math.pi


def test_two_lasers_that_look_ahead_do_not_see_what_is_behind() -> None:
    ahead: dict[str, SensorConfig] = {
        "left": LidarConfig(field_of_view_rad=2.0, mount=Mount(y_m=0.2, theta_rad=0.4)),
        "right": LidarConfig(field_of_view_rad=2.0, mount=Mount(y_m=-0.2, theta_rad=-0.4)),
    }
    sheet = joint_lidar(ahead)
    assert sheet is not None
    assert sheet.field_of_view_rad == pytest.approx(2.8)
    assert (sheet.mount.x_m, sheet.mount.y_m, sheet.mount.theta_rad) == pytest.approx(
        (0.0, 0.0, 0.0), abs=1e-9
    )
    assert joint_lidar({"left": ahead["left"]}) is None


def test_a_laser_that_reaches_less_says_nothing_of_what_is_beyond() -> None:
    short = {**CORNERS, "back": LidarConfig(beams=541, max_range_m=3.0, mount=CORNERS["back"].mount)}
    join, ranges_m = joined(short, Pose2(0.0, 0.0, 0.0))
    looks = join.sheet.beam_angles_rad() + join.sheet.mount.theta_rad
    behind = np.abs(np.remainder(looks, 2 * math.pi) - 3.27) < 0.06  # where the other does not look
    assert behind.any()
    assert np.isnan(ranges_m[behind]).all()  # the hall ends 9 m behind


def test_the_particle_filter_weighs_both(tmp_path: Path) -> None:
    base = ("stack.localizer=particle-filter", "stack.reactive=null", "run.time_limit_s=12")
    off_m = []
    for more in ((), ("robot.sensors.front=null",)):
        run = run_loop(build(mission_of(tmp_path, "museum-1", *base, *more))).finished
        trace = run.robots[0].trace
        off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])[20:]
        cov = np.array([[trace["cov_xx_m2"], trace["cov_xy_m2"]], [trace["cov_xy_m2"], trace["cov_yy_m2"]]])[
            ..., 20:
        ]
        wide = np.sqrt(np.linalg.eigvalsh(cov.transpose(2, 0, 1))[:, -1])
        assert (off < 5.0 * wide + 0.002).all()  # it is as sure as it may be
        off_m.append(float(np.sqrt((off**2).mean())))
    assert off_m[0] < 0.004
    assert off_m[0] < off_m[1] + 0.001  # no worse than by one alone


@pytest.mark.parametrize(
    ("base", "more"),
    [
        ("museum-walls", ()),
        ("museum-1-fast", ()),
        ("museum-unknown", ("stack.localizer=slam",)),
        ("museum-patrol", ("team.size=1", "run.time_limit_s=3")),
    ],
)
def test_whoever_asks_for_the_scan_takes_both(tmp_path: Path, base: str, more: tuple[str, ...]) -> None:
    limit = () if base == "museum-patrol" else ("run.time_limit_s=3",)
    finished = run_loop(build(mission_of(tmp_path, base, *more, *limit))).finished
    trace = finished.robots[0].trace
    assert finished.robots[0].collisions == 0
    assert np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])[-1] < 0.02


@pytest.mark.parametrize("localizer", ["particle-filter", "ekf-walls"])
def test_who_stands_is_not_ever_surer_of_what_beams_between_the_lasers_are_off_by(
    localizer: str, tmp_path: Path
) -> None:
    """Its standard deviation fell to a tenth of its error, half a millimetre, within half a minute."""
    stands = "stack.navigator={name: open-loop, program: [{duration_s: 4, speed_m_s: 0.5}, {duration_s: 25}]}"
    words = (f"stack.localizer={{name: {localizer}}}", stands, "task=drive", "world.goal=null")
    mission = mission_of(tmp_path, "museum-walls", *words, "stack.planner=null", "run.time_limit_s=30")
    robot = run_loop(build(mission)).finished.robots[0]
    off = nees(poses(robot.trace, "true"), poses(robot.trace, "est"), covariances(robot.trace))
    assert off[-50:].mean() < 8.0
    spread = np.sqrt(robot.trace["cov_xx_m2"] + robot.trace["cov_yy_m2"])
    assert spread[-1] > 0.7 * spread[50]


def test_lasers_that_scan_at_other_times_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"one rate_hz.*front 10 Hz, back 5 Hz.*robot.sensors.back=null"):
        build(mission_of(tmp_path, "museum-walls", "robot.sensors.back.rate_hz=5"))


def test_what_a_wall_hides_from_between_the_lasers_speaks_against_nobody() -> None:
    """In a door lasers see, in front and behind, what posts hide from the middle: a filter that knew its
    place to a millimetre gave it up as contradicted."""
    door = np.array(
        [[0.0, 0.6, 0.0, 9.0], [0.0, -0.6, 0.0, -9.0], [6.0, -9.0, 6.0, 9.0], [-6.0, -9.0, -6.0, 9.0]]
    )
    walls = SegmentMap.of(door, np.zeros((0, 3)))
    sensors: dict[str, SensorConfig] = {
        "front": LidarConfig(beams=195, field_of_view_rad=3.4, mount=Mount(x_m=0.9)),
        "back": LidarConfig(beams=195, field_of_view_rad=3.4, mount=Mount(x_m=-0.9, theta_rad=math.pi)),
    }
    pose = Pose2(0.1, 0.3, 0.1)
    join, ranges_m = joined(sensors, pose, door, np.zeros((0, 3)))
    eyes_m = places_of_lasers_m(join.sheet, sensors)
    assert np.hypot(*eyes_m.T) == pytest.approx([0.9, 0.9])
    alone, known = (
        ScanFit(walls, join.sheet, 20.0, 0.1, 0.3, eyes).of(pose.as_array(), ranges_m)
        for eyes in (np.zeros((0, 2)), eyes_m)
    )
    assert alone.contradicted > 0.05
    assert known.contradicted < 0.01
    assert known.explained > 0.95
    elsewhere = np.array([1.5, 0.05, 0.2])
    assert ScanFit(walls, join.sheet, 20.0, 0.1, 0.3, eyes_m).of(elsewhere, ranges_m).explained < 0.3


@pytest.mark.parametrize(("looks_rad", "kept"), [(4.0, True), (5.0, False)])
def test_a_mapper_keeps_what_no_laser_looks_at(looks_rad: float, kept: bool) -> None:
    """A post beside the body was mapped as the robot came up to it; its lasers look ahead and behind. From
    between them beams pass over it to a wall that both see."""
    hall = np.array(
        [[-9.0, -3.0, 9.0, -3.0], [9.0, -3.0, 9.0, 3.0], [9.0, 3.0, -9.0, 3.0], [-9.0, 3.0, -9.0, -3.0]]
    )
    chart = WorldMap("hall", (-9.0, -3.0, 9.0, 3.0), SegmentMap.of(hall, np.zeros((0, 3))))
    post, nothing = np.array([[0.0, 0.9, 0.05]]), np.zeros((0, 3))
    lasers = {
        "front": LidarConfig(beams=195, field_of_view_rad=looks_rad, mount=Mount(x_m=0.9)),
        "back": LidarConfig(beams=195, field_of_view_rad=looks_rad, mount=Mount(x_m=-0.9, theta_rad=math.pi)),
    }
    told, join = with_joint_lidar(
        RobotKnowledge(Footprint.disc(0.3), DifferentialDriveConfig(), lasers, 0.1, RandomStreams(0, "robot"))
    )
    assert join is not None
    layer = ObstacleLayer(ObstacleLayerConfig(), told, chart)

    def look(pose: Pose2, posts: FloatArray) -> None:
        scans = {name: LidarScan(seen(sheet, pose, hall, posts)) for name, sheet in lasers.items()}
        layer.step(join.add(Readings(0.0, scans)), Belief(pose, 1e-6 * np.eye(3)))

    for _ in range(4):
        look(Pose2(-2.0, 0.0, 0.0), post)
    assert len(layer.circles_m)
    for _ in range(4):
        look(Pose2(0.0, 0.0, 0.0), post if kept else nothing)
    assert bool(len(layer.circles_m)) == kept


def test_beams_of_which_nothing_is_known_are_not_unexplained() -> None:
    walls = SegmentMap.of(HALL, np.zeros((0, 3)))
    sheet = LidarConfig(beams=181)
    ranges_m = seen(sheet, Pose2(0.0, 0.0, 0.0), HALL, np.zeros((0, 3)))
    ranges_m[:120] = math.nan
    fit = ScanFit(walls, sheet, 20.0, 0.1, 0.3)
    assert fit.of(np.zeros(3), ranges_m).explained == 1.0
    assert fit.of(np.zeros(3), np.full(181, math.nan)).contradicted == 0.0
