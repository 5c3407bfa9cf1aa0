"""Lost robots: poses from crossing lines, places that tell them apart, safe wandering, honest status."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.build.open_floor import random_pose
from pilotage.experiments.mission import load_mission
from pilotage.experiments.resolve import resolved_yaml
from pilotage.kernels.arrays import read_only
from pilotage.kernels.geometry import plane
from pilotage.kernels.lines import viewpoints
from pilotage.kernels.scans import wander
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.missions.places import PoseConfig
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import Mount
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.wander import WanderConfig, Wanderer
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.localization.ekf_walls import EkfWallsConfig, EkfWallsLocalizer
from pilotage.stack.localization.global_search import GlobalSearch, GlobalSearchConfig
from pilotage.stack.localization.laser import LaserConfig
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_prediction import OdometryNoise, OdometryPrediction
from pilotage.stack.localization.particle_filter import MclConfig
from pilotage.stack.localization.scan_fit import ScanFit
from pilotage.stack.localization.wall_matching import WallMatcher, WallMatchingConfig
from support.robots import ROOM, Told, sensors, told_of
from support.walls import LIDAR, extractor, scan_of
from support.worlds import ROOM_MAP, Alone, alone, robot, walled

MUSEUM = load_chart("museum").walls
BOX = SegmentMap.of(box_segments(5.0, 4.0, 10.0, 8.0, 0.0))


def search_in(world: SegmentMap) -> GlobalSearch:
    """A global search for a scanner at the robot's centre."""
    mount = np.zeros(3)
    prediction = OdometryPrediction(WheelOdometryConfig(), OdometryNoise(), 1.0, OdometryModel.EXACT_ARC)
    return GlobalSearch(
        GlobalSearchConfig(),
        world,
        ScanFit(world, LIDAR, 19.9, 0.1, 0.3),
        WallMatcher(WallMatchingConfig(), 0.999, world, mount),
        mount,
        prediction,
        0.3,
    )


def is_near(pose: FloatArray, truth: Pose2) -> bool:
    """Within a hand and two degrees."""
    away = math.hypot(pose[0] - truth.x_m, pose[1] - truth.y_m)
    return away < 0.1 and abs(wrap_to_pi(float(pose[2]) - truth.theta_rad)) < 0.035


def lost_in(world: SegmentMap, start: Pose2) -> tuple[Alone, EkfWallsLocalizer, Told]:
    """A robot at ``start`` that is told nothing."""
    told = told_of(world=world, start=start, initial=Belief.anywhere(world.bounds_m))
    sim = alone(robot(sensors(), start=start, seed=1), walled(world))
    return sim, told.localizer(EkfWallsLocalizer, EkfWallsConfig()), told


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.5), (4.0, 3.0, 1.0), (11.0, 2.0, -2.0)])
def test_a_wrong_and_vague_start_is_noticed(off: tuple[float, float, float]) -> None:
    # A tenth of a metre and of a radian: too unsure to expect a scan, too far off to match a wall.
    truth = Pose2(3.5, 16.0, 0.4)
    believed = Pose2(truth.x_m + off[0], truth.y_m + off[1], truth.theta_rad + off[2])
    told = told_of(world=MUSEUM, start=believed, initial=Belief(believed, 0.01 * np.eye(3)))
    sim = alone(robot(sensors(), start=truth, seed=1), walled(MUSEUM))
    localizer = told.localizer(EkfWallsLocalizer, EkfWallsConfig())
    lost_at = -1
    for step in range(80):
        belief = localizer.step(sim.step(Twist(0.2, 0.5)))
        if lost_at < 0 and belief.status is BeliefStatus.LOST:
            lost_at = step
    assert 0 <= lost_at <= 20
    assert belief.status is BeliefStatus.LOCALIZED
    assert is_near(belief.pose.as_array(), sim.truth)


def test_the_true_pose_is_among_the_hypotheses_of_one_scan() -> None:
    rng = np.random.default_rng(1)
    for seed in range(40):
        drawn = random_pose(load_chart("museum"), PoseConfig(x_m=1.0, y_m=1.0), 0.45, rng)
        truth = Pose2(drawn.x_m, drawn.y_m, drawn.theta_rad)
        ranges = scan_of(MUSEUM, truth, rng)
        search = search_in(MUSEUM)
        assert search.look(extractor(seed).extract(ranges), ranges) is None, "one scan is never enough"
        assert any(is_near(hypothesis.pose, truth) for hypothesis in search.hypotheses)


def test_a_room_that_looks_the_same_from_both_ends_keeps_two_hypotheses() -> None:
    sim, localizer, told = lost_in(BOX, Pose2(3.0, 3.0, 0.4))
    for step in range(150):
        belief = localizer.step(sim.step(Twist(0.4, 0.5 if step % 100 < 50 else -0.5)))
        assert belief.status is BeliefStatus.LOST
        assert told.said["localized"] == 0.0
    assert told.said["hypotheses"] == 2.0
    assert localizer.look_bearing_rad() is None, "nowhere in this room would they differ"


def test_in_a_room_with_a_mark_it_finds_itself_and_says_so_only_then() -> None:
    marked = BOX.with_obstacles(np.array([[7.0, 0.0, 7.0, 3.0]]), np.zeros((0, 3)))
    sim, localizer, _ = lost_in(marked, Pose2(2.0, 2.0, 0.4))
    statuses = []
    for step in range(120):
        belief = localizer.step(sim.step(Twist(0.3, 0.5 if step % 80 < 40 else -0.5)))
        statuses.append(belief.status)
        if belief.status is BeliefStatus.LOCALIZED:
            assert is_near(belief.pose.as_array(), sim.truth)
        else:
            assert math.sqrt(belief.cov[0, 0]) > 2.0, "lost means knowing nothing"
    assert statuses[0] is BeliefStatus.LOST
    assert statuses[-1] is BeliefStatus.LOCALIZED


def test_a_robot_carried_elsewhere_notices_at_once() -> None:
    told = told_of(start=Pose2(2.0, 2.0, 0.0), variances=(1e-4, 1e-4, 1e-4))
    sim = alone(robot(sensors(), start=Pose2(2.0, 2.0, 0.0), seed=0))
    localizer = told.localizer(EkfWallsLocalizer, EkfWallsConfig())
    for _ in range(10):
        assert localizer.step(sim.step(Twist(0.2, 0.3))).status is BeliefStatus.LOCALIZED
    sim.body.carry_to(Pose2(8.0, 6.5, 2.0))
    statuses = [localizer.step(sim.step(Twist(0.2, 0.3))).status for _ in range(3)]
    assert statuses[-1] is BeliefStatus.LOST


def test_only_localizers_that_search_start_without_a_pose() -> None:
    walls, cells = EkfWallsConfig(recovery=None), MclConfig(relocalize=False)
    never = {"ekf-walls": walls, "particle-filter": cells, "laser": LaserConfig(walls=walls, cells=cells)}
    for entry in LOCALIZERS:
        nowhere = told_of(initial=Belief.anywhere(ROOM.bounds_m))
        config = entry.config()
        if entry.name in never:
            assert nowhere.localizer(entry.factory, config).belief.status is BeliefStatus.LOST
            config = never[entry.name]
        with pytest.raises(InputError, match="ekf-walls" if entry.name not in never else "known"):
            nowhere.localizer(entry.factory, config)


def test_the_telling_place_is_where_the_views_differ() -> None:
    """A box with a niche in one end wall, and two poses half a turn apart: the niche tells them apart."""
    segments = np.array(
        [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0], [6.5, 8, 6.5, 6], [6.5, 6, 9, 6]], float
    )
    field = DistanceField.from_map(SegmentMap.of(segments), 0.25)
    free = field.distance_m >= 0.42
    poses = np.array([[8.0, 7.0, math.pi], [2.0, 1.0, 0.0]])
    path = viewpoints.telling_path(
        free, 0.0, 0.0, 0.25, poses, 2.3, 28, 20.0, 0.5, 0.08, 6000, read_only(segments), plane.NO_CIRCLES
    )
    assert path.shape[0] >= 2
    assert np.hypot(*(path[0] - poses[0, :2])) < 0.25
    assert np.hypot(*np.diff(path, axis=0).T).max() < 0.36
    twins = viewpoints.telling_path(
        free,
        0.0,
        0.0,
        0.25,
        poses[[0, 0]],
        2.3,
        28,
        20.0,
        0.5,
        0.08,
        6000,
        read_only(segments),
        plane.NO_CIRCLES,
    )
    assert twins.shape[0] == 0


def test_a_lane_is_as_long_as_the_floor_is_free() -> None:
    points = np.array([[2.0, 0.1], [1.0, 0.5], [-1.0, 0.0]])
    lengths = wander.free_lengths(points, np.array([0.0, math.pi / 2, math.pi]), 0.4, 5.0)
    assert lengths == pytest.approx([2.0, 5.0, 1.0])


@pytest.mark.parametrize(
    ("turned_rad", "unmeasured", "ahead"),
    [
        (0.0, slice(0), True),
        (0.0, slice(0, None, 7), True),
        (0.0, slice(60, 121), False),
        (3.1, slice(0), False),
    ],
)
def test_a_lane_that_nobody_measured_is_none(turned_rad: float, unmeasured: slice, ahead: bool) -> None:
    """One beam without a measurement was a wall before the scanner, or none; behind a laser all was free."""
    lidar = LidarConfig(beams=181, field_of_view_rad=math.pi, mount=Mount(x_m=0.2, theta_rad=turned_rad))
    wanderer = Wanderer.of(WanderConfig(), replace(told_of().robot, sensors={"lidar": lidar}))
    assert wanderer is not None
    ranges_m = np.full(181, 10.0)
    ranges_m[unmeasured] = math.nan
    command = wanderer.step(Readings(0.0, {"lidar": LidarScan(ranges_m)}))
    assert (command.v_m_s > 0.0) is ahead


@pytest.mark.parametrize("bearing", [None, 0.0, 2.0, -3.0])
def test_wandering_touches_nothing(bearing: float | None) -> None:
    """Even where it is led into the walls all the time."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        drawn = random_pose(ROOM_MAP, PoseConfig(x_m=2.0, y_m=2.0), 0.5, rng)
        start = Pose2(drawn.x_m, drawn.y_m, drawn.theta_rad)
        told = told_of(start=start)
        sim = alone(robot(sensors(), start=start, seed=seed))
        wanderer = Wanderer.of(WanderConfig(), told.robot)
        assert wanderer is not None
        command, way = Twist(0.0, 0.0), 0.0
        for _ in range(400):
            before = sim.truth
            command = wanderer.step(sim.step(command), bearing)
            way += math.hypot(sim.truth.x_m - before.x_m, sim.truth.y_m - before.y_m)
            assert sim.body.clearance_m > 0.02
        assert sim.body.collisions == 0
        if bearing is None:
            assert way > 5.0


def test_random_places_are_drawn_from_the_seed_and_recorded() -> None:
    mission = load_mission("museum-lost", seed=4)
    settled = build(mission).mission
    assert settled.world.random_start is None
    assert settled == build(mission).mission
    assert build(load_mission("museum-lost", seed=5)).mission.world.start != settled.world.start
    assert "random_start: null" in resolved_yaml(settled)
    anywhere = build(load_mission("museum-lost", ("world.start=null",), seed=4)).mission.world.start
    assert anywhere == settled.world.start  # the largest floor is the one that the file's start is on
    carried = build(load_mission("museum-kidnap", seed=4)).mission.world.kidnaps[0].to
    assert carried is not None
    assert MUSEUM.distance_m(carried.x_m, carried.y_m) >= 0.6


def test_random_places_are_connected_to_the_start() -> None:
    walled_off = BOX.with_obstacles(np.array([[5.0, 0.0, 5.0, 8.0]]), np.zeros((0, 3)))
    rng = np.random.default_rng(0)
    for _ in range(50):
        pose = random_pose(walled(walled_off), PoseConfig(x_m=1.0, y_m=1.0), 0.5, rng)
        assert pose.x_m <= 4.5 + 1e-9
        assert plane.distance_to_nearest(pose.x_m, pose.y_m, walled_off.segments_m, np.zeros((0, 3))) >= 0.5
    # A team's starts were drawn nearer to walls than where one is carried, and refused as starts for that.
    beside_a_wall = [
        random_pose(walled(walled_off), PoseConfig(x_m=4.85, y_m=1.0), 0.5, rng) for _ in range(10)
    ]
    assert max(pose.x_m for pose in beside_a_wall) <= 4.5 + 1e-9
    with pytest.raises(InputError, match=r"expected random places 0\.5 m from walls to be reached from"):
        random_pose(walled(walled_off), PoseConfig(x_m=5.0, y_m=1.0), 0.5, rng)
