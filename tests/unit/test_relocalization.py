"""Lost robots: scans joined by odometry, the whole map searched, a place tried before it is believed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.maps.rasterize import rasterized
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import OdometryIncrement
from pilotage.stack.journal import Journal
from pilotage.stack.localization.ekf_walls import EkfWallsLocalizer
from pilotage.stack.localization.laser import LaserConfig, LaserLocalizer
from pilotage.stack.localization.likelihood_field import LikelihoodField
from pilotage.stack.localization.particle_filter import ParticleFilterLocalizer
from pilotage.stack.localization.relocalization import TRIAL_SCANS, Relocalization, Trial
from pilotage.stack.localization.scan_search import LEAST_POINTS, RecentScans, ScanSearch
from support.laser_rooms import furnished, ranges
from support.robots import told_of

ANGLES = LidarConfig(beams=180).beam_angles_rad()
BOUNDS_M = (0.0, 0.0, 12.0, 9.0)
HALL = np.array([[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 9.0], [12.0, 9.0, 0.0, 9.0], [0.0, 9.0, 0.0, 0.0]])


def field_of(walls: FloatArray, cells: bool) -> tuple[LikelihoodField, tuple[float, float, float, float]]:
    bounds_m = (
        float(walls[:, [0, 2]].min()),
        float(walls[:, [1, 3]].min()),
        float(walls[:, [0, 2]].max()),
        float(walls[:, [1, 3]].max()),
    )
    room = SegmentMap(walls, np.zeros((0, 3)), bounds_m)
    grid = rasterized(room, 0.05) if cells else None
    chart = WorldMap("room", bounds_m, None if cells else room, grid=grid)
    field = LikelihoodField(
        chart, resolution_m=0.05, range_var_m2=1e-5, field_std_m=None, random_share=0.05, reach_m=20.0
    )
    return field, bounds_m


def seen_from(walls: FloatArray, pose: FloatArray) -> FloatArray:
    found = ranges(walls, pose, ANGLES)
    hit = np.isfinite(found)
    return np.asarray(found[hit, None] * np.column_stack([np.cos(ANGLES[hit]), np.sin(ANGLES[hit])]))


def test_scans_are_joined_by_the_odometry() -> None:
    walls, recent = furnished(), RecentScans()
    x, y, theta = 2.0, 3.5, 0.2
    for _ in range(6):
        recent.see(seen_from(walls, np.array([x, y, theta])))
        recent.move(0.5, 0.0, 0.0)
        x, y = x + 0.5 * math.cos(theta), y + 0.5 * math.sin(theta)
    there = recent.cloud(6) @ np.array(
        [[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]]
    )
    field, _ = field_of(walls, cells=False)
    away = field.distances_m(there + np.array([x, y]))
    assert away.max() < 0.05, "a node's nearest wall is not always a point's"
    assert away.mean() < 1e-3


@pytest.mark.parametrize("cells", [False, True])
@pytest.mark.parametrize("pose", [(2.0, 3.5, 0.2), (8.0, 2.0, 2.0)])
def test_the_place_is_found_on_walls_and_on_cells(cells: bool, pose: tuple[float, float, float]) -> None:
    field, bounds_m = field_of(furnished(), cells)
    place = ScanSearch(field, bounds_m).best(seen_from(furnished(), np.array(pose)))
    assert place is not None
    assert place.alone
    assert np.hypot(*(place.pose[:2] - pose[:2])) < 0.15
    assert abs(math.remainder(place.pose[2] - pose[2], math.tau)) < 0.02


def test_two_places_that_look_alike_are_told_apart_by_nobody() -> None:
    field, bounds_m = field_of(HALL, cells=False)
    place = ScanSearch(field, bounds_m).best(seen_from(HALL, np.array([2.0, 3.0, 0.4])))
    assert place is not None
    assert not place.alone


def test_scans_of_another_building_fit_nowhere() -> None:
    field, bounds_m = field_of(furnished(), cells=False)
    rng = np.random.default_rng(0)
    assert ScanSearch(field, bounds_m).best(rng.uniform(-4.0, 4.0, (300, 2))) is None


@pytest.mark.parametrize(
    ("share", "weight", "passes"), [(0.9, 1.0, True), (0.3, 1.0, False), (0.9, 2.0 / 60.0, False)]
)
def test_a_place_counts_after_a_trial(share: float, weight: float, passes: bool) -> None:
    walls, (field, bounds_m) = furnished(), field_of(furnished(), cells=False)
    again, mean = Relocalization(field, bounds_m), np.zeros(3)
    pose, found = np.array([2.0, 3.5, 0.2]), None
    for k in range(6):
        again.see(seen_from(walls, pose))
        found = again.begin(1.0 * k, lost=True, mean=mean)
        if found is not None:
            break
        again.move(OdometryIncrement(0.5, 0.0))
        pose = pose + np.array([0.5 * math.cos(0.2), 0.5 * math.sin(0.2), 0.0])
    assert found is not None
    assert np.hypot(*(found - pose)[:2]) < 0.15
    verdicts = []
    for _ in range(2 * TRIAL_SCANS):
        again.move(OdometryIncrement(0.1, 0.0))
        verdicts.append(again.passed(share, weight, 0.9))
    assert [verdict for verdict in verdicts if verdict is not None] == ([passes] if weight == 1.0 else [])
    assert (again.trial is None) == (weight == 1.0)  # two beams of 60 say nothing yet


def test_few_points_fit_nowhere() -> None:
    walls, (field, bounds_m) = furnished(), field_of(furnished(), cells=False)
    seen = seen_from(walls, np.array([2.0, 3.5, 0.2]))
    search = ScanSearch(field, bounds_m)
    assert search.best(seen) is not None
    assert search.best(seen[: LEAST_POINTS - 1]) is None


def test_a_robot_told_nothing_and_one_carried_away_find_themselves() -> None:
    localizer = ("stack.localizer={name: particle-filter}",)
    (lost,) = simulate(load_mission("museum-lost", localizer, 2)).finished.robots
    assert lost.arrived, lost.reason
    (carried,) = simulate(load_mission("museum-kidnap", localizer, 2)).finished.robots
    assert carried.arrived, carried.reason
    assert not carried.collisions


@pytest.mark.parametrize(
    ("off", "elsewhere"), [((0.0, 0.0, 0.0), False), ((7.0, -4.0, 0.0), True), ((0.0, 0.0, 1.5), True)]
)
def test_a_belief_is_none_where_scans_fit_better_in_two_places(
    off: tuple[float, float, float], elsewhere: bool
) -> None:
    """Of rooms that look alike none could be told, and the filter believed what fitted for three seconds."""
    field, bounds_m = field_of(HALL, cells=False)
    again, pose = Relocalization(field, bounds_m), np.array([2.0, 6.0, 0.0])
    for k in range(6):
        again.see(seen_from(HALL, pose))
        assert again.begin(1.0 * k, lost=True, mean=pose + off) is None
        again.move(OdometryIncrement(0.5, 0.0))
        pose = pose + np.array([0.5, 0.0, 0.0])
    assert again.trial is None
    assert again.elsewhere is elsewhere
    again.begin(9.0, lost=False, mean=pose)
    assert not again.elsewhere


def test_a_trial_that_the_map_cannot_judge_ends() -> None:
    field, bounds_m = field_of(furnished(), cells=False)
    again = Relocalization(field, bounds_m)
    again.trial = Trial()
    for _ in range(20):
        again.move(OdometryIncrement(0.3, 0.0))
    assert again.trial is None


def test_scans_a_metre_apart_end_a_trial_as_others_do() -> None:
    """After five metres, with five scans of fifteen, it was given up: slow lasers were never found again."""
    field, bounds_m = field_of(furnished(), cells=False)
    again = Relocalization(field, bounds_m)
    again.trial = Trial()
    for _ in range(TRIAL_SCANS - 1):
        again.move(OdometryIncrement(1.0, 0.0))
        assert again.passed(0.8, 1.0, 0.8) is None
        assert again.trial is not None
    again.move(OdometryIncrement(1.0, 0.0))
    assert again.passed(0.8, 1.0, 0.8) is True


def test_beams_are_weighed_alone_as_together() -> None:
    field, _ = field_of(furnished(), cells=True)
    pose = np.array([2.0, 3.5, 0.2])
    points = seen_from(furnished(), np.array([2.05, 3.45, 0.21]))
    alone = field.log_densities(points, pose)
    assert alone.sum() == pytest.approx(field.log_likelihoods(points, pose[None])[0])


def test_the_laser_localizer_takes_the_filter_that_suits_the_map() -> None:
    told = told_of()
    walls = told.chart.walls
    cells = WorldMap("cells", walls.bounds_m, grid=rasterized(walls, 0.05))
    for chart, kind in ((told.chart, EkfWallsLocalizer), (cells, ParticleFilterLocalizer)):
        found = LaserLocalizer(LaserConfig(), told.robot, chart, told.initial, Journal())
        assert isinstance(found._localizer, kind)
        assert found.belief is told.initial
        assert found.look_bearing_rad() is None


@pytest.mark.parametrize(
    ("leap_m", "told", "elsewhere"), [(0.1, True, False), (4.0, True, True), (0.0, False, True)]
)
def test_who_settles_elsewhere_is_believed_by_a_trial_alone(
    leap_m: float, told: bool, elsewhere: bool
) -> None:
    """A wide cloud took the twin of the true place, half a turn about the room's middle, for 100 s."""
    field, bounds_m = field_of(HALL, cells=False)
    again, pose = Relocalization(field, bounds_m, told), np.array([2.0, 6.0, 0.0])
    if told:
        again.begin(0.0, lost=False, mean=pose)
    for k in range(4):
        again.move(OdometryIncrement(0.1, 0.0))
        pose = pose + np.array([0.1, 0.0, 0.0])
        leap = np.array([leap_m if k == 1 else 0.0, 0.0, 0.0])
        again.begin(0.1 * k, lost=True, mean=pose + leap)
    assert again.elsewhere is elsewhere, "also once it is back"
    again.trial = Trial()
    while again.passed(0.9, 1.0, 0.9) is None:
        again.move(OdometryIncrement(0.1, 0.0))
    again.begin(9.0, lost=True, mean=pose)
    assert not again.elsewhere
