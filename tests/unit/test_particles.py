"""The particle filter's arithmetic."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2, norm

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.evaluation.driving import poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.filters import particles
from pilotage.maps.nearest_obstacles import NearestObstacles
from pilotage.maps.rasterize import rasterized
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.stack.interface import BeliefStatus
from pilotage.stack.localization.likelihood_field import thin_share
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_doubt import OdometryDoubt
from pilotage.stack.localization.particle_filter import MclConfig, ParticleFilterLocalizer
from pilotage.stack.localization.same_witness import SameWitness
from support.robots import ROOM, sensors, told_of
from support.worlds import alone, robot, walled

MCL = "stack.localizer.name=particle-filter"


def cloud(count: int = 500, seed: int = 0) -> FloatArray:
    """Particles about a pose near the cut of the heading."""
    rng = np.random.default_rng(seed)
    root = np.array([[0.1, 0, 0], [0.05, 0.08, 0], [0.02, -0.03, 0.1]])
    drawn = np.array([1.0, 2.0, 3.1]) + rng.standard_normal((count, 3)) @ root.T
    drawn[:, 2] = (drawn[:, 2] + math.pi) % (2 * math.pi) - math.pi
    return np.ascontiguousarray(drawn)


@settings(max_examples=60)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30), st.integers(1, 100), st.floats(0, 0.999))
def test_every_particle_is_drawn_as_often_as_its_weight_says(
    raw: list[float], count: int, start: float
) -> None:
    weights = np.array(raw) + 1e-3
    weights /= weights.sum()
    drawn = particles.low_variance_indices(weights, count, start)
    times = np.bincount(drawn, minlength=weights.shape[0])
    assert times.sum() == count
    assert (np.abs(times - count * weights) < 1.0 + 1e-9).all()


@settings(max_examples=40)
@given(st.integers(0, 1000), st.floats(1.0, 500.0))
def test_tempering_leaves_as_much_of_the_cloud_as_is_asked_for(seed: int, sharpness: float) -> None:
    likelihoods = -sharpness * np.random.default_rng(seed).chisquare(3, size=200)
    part = particles.largest_exponent(likelihoods, 1.0, 100.0)
    assert 0.0 < part <= 1.0
    left = particles.effective_count(likelihoods, part)
    assert left >= 100.0 - 1e-6
    assert part == 1.0 or left == pytest.approx(100.0, abs=0.1)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.002, 0.5), st.floats(-20.0, 5.0))
def test_a_narrow_cloud_is_weighed_as_each_of_its_particles_alone(seed: int, width: float, at: float) -> None:
    """One wall may be before all of them, or several, or the map's end."""
    rng = np.random.default_rng(seed)
    field = NearestObstacles.from_map(ROOM, 0.1)
    poses = np.ascontiguousarray(
        np.column_stack([rng.normal(at, width, 60), rng.normal(2.0, width, 60), rng.normal(3.1, width, 60)])
    )
    points, table = rng.uniform(-6.0, 6.0, (20, 2)), -np.arange(50.0)
    alone_ = np.empty(60)
    together = particles.log_likelihoods(poses, points, field.nodes, table, 0.02)
    for k in range(60):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        away = field.at(poses[k, :2] + points @ np.array([[c, s], [-s, c]]))
        alone_[k] = table[np.minimum(away / 0.02 + 0.5, 49.0).astype(int)].sum()
    # A distance beside the border of two entries of the table may round to either.
    assert together == pytest.approx(alone_, abs=2.0)


def test_spreading_keeps_the_mean_and_the_covariance() -> None:
    before = cloud(200_000)
    weights = np.full(before.shape[0], 1.0 / before.shape[0])
    mean, cov, mean_after, cov_after = np.empty(3), np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    particles.moments(before, weights, mean, cov)
    after = before.copy()
    normals = np.random.default_rng(1).standard_normal(after.shape)
    root = np.asarray(np.linalg.cholesky(cov), dtype=np.float64)
    particles.spread_out(after, mean, root, 0.5, normals)
    particles.moments(after, weights, mean_after, cov_after)
    assert mean_after == pytest.approx(mean, abs=2e-3)
    assert cov_after == pytest.approx(cov, rel=0.02, abs=2e-4)
    assert (after[:, 2] < math.pi).all()
    assert (after[:, 2] >= -math.pi).all()


def joined(
    witness: SameWitness, prior: FloatArray, scan: FloatArray, alike: float, given: float
) -> FloatArray:
    """Information (3, 3) that is left after a scan of that information, let in with a share of its weight."""
    posterior: FloatArray = np.asarray(np.linalg.inv(np.linalg.inv(prior) + given * scan), dtype=np.float64)
    root = witness.widening(prior, posterior, alike, given)
    left = root @ posterior @ root.T
    assert (np.linalg.eigvalsh(left - posterior) >= -1e-9 * np.linalg.norm(posterior)).all(), "never narrower"
    return np.asarray(np.linalg.inv(left))


def test_scans_from_one_place_tell_as_much_as_one_of_them() -> None:
    witness, scan, info = SameWitness(), np.diag([1e4, 4e4, 1e6]), np.diag([1.0, 1.0, 1.0])
    for _ in range(500):
        info = joined(witness, np.linalg.inv(info), scan, 0.98, 0.02)
    share = np.diag(info) / np.diag(scan)
    assert (share >= 0.99).all()
    assert (share <= 1.0 / 0.98).all()


def test_scans_from_everywhere_tell_together() -> None:
    witness, scan, info = SameWitness(), np.diag([1e4, 4e4, 1e6]), np.diag([1.0, 1.0, 1.0])
    for _ in range(10):
        info = joined(witness, np.linalg.inv(info), scan, 1e-9, 1.0 - 1e-9)
    assert np.diag(info) == pytest.approx(10.0 * np.diag(scan), rel=0.01)


@pytest.mark.parametrize("alike", [0.999, 0.98, 0.6, 0.3, 1e-6])
def test_what_scans_do_not_tell_is_not_forgotten_for_them(alike: float) -> None:
    """Along a corridor all scans are alike: its walls say nothing of how far the robot is."""
    witness, across = SameWitness(), np.diag([0.0, 1e4, 1e6])
    info = np.diag([400.0, 1.0, 1.0])
    for _ in range(200):
        info = joined(witness, np.linalg.inv(info), across, alike, 1.0 - alike)
    assert info[0, 0] == pytest.approx(400.0, rel=1e-6)
    assert info[1, 1] >= 0.99 * (1.0 - alike**200) * 1e4


def test_a_scan_that_was_let_in_whole_tells_no_more_than_one_where_scans_like_it_told_before() -> None:
    """Known as one scan tells across, and unsure of the heading: the first is left, the second is told."""
    witness, scan = SameWitness(), np.diag([0.0, 4e3, 1e6])
    known = np.diag([1.0, 4e3, 1e6])
    for _ in range(20):
        joined(witness, np.linalg.inv(known), scan, 0.98, 0.02)
    unsure = np.diag([1.0, 4e3, 1e2])
    left = joined(witness, np.linalg.inv(unsure), scan, 0.98, 1.0)
    assert np.diag(left) == pytest.approx([1.0, 4e3, 1e6], rel=1e-3)
    # All particles in one place, as odometry without noise leaves them: only the heading is widened.
    root = witness.widening(np.diag([0.0, 0.0, 0.3]), np.diag([0.0, 0.0, 1e-4]), 0.98, 0.4)
    assert np.isfinite(root).all()
    assert root[2, 2] >= 1.0


def test_moments_know_the_circle() -> None:
    some = cloud()
    mean, cov = np.empty(3), np.empty((3, 3))
    particles.moments(some, np.full(500, 1 / 500), mean, cov)
    assert abs(mean[2]) > 3.0
    assert cov[2, 2] == pytest.approx(0.0113, rel=0.3)
    assert (cov == cov.T).all()


def test_the_kld_bound_is_foxs() -> None:
    # n = chi2_{k-1, 1-delta} / (2 eps); his eq. 7 is the Wilson-Hilferty form of it.
    for bins in (10, 100, 2000):
        exact = chi2.ppf(0.99, bins - 1) / (2 * 0.05)
        assert particles.kld_count(bins, 0.05, float(norm.ppf(0.99))) == pytest.approx(exact, rel=0.01)
    assert particles.kld_count(1, 0.05, 2.3) == 1.0


def test_bins_are_counted_once() -> None:
    some = np.array([[0.01, 0.01, 0.0], [0.02, 0.02, 0.005], [-0.01, 0.01, 0.0], [0.01, 0.01, 3.0]])
    assert particles.occupied_bins(some, 0.05, 0.1) == 3


def test_motion_spreads_as_the_noise_says() -> None:
    moved = np.zeros((100_000, 3))
    normals = np.random.default_rng(2).standard_normal((100_000, 2))
    particles.sample_motion(moved, 1.0, 0.0, 0.05, 0.02, normals, True)
    assert moved[:, 0].std() == pytest.approx(0.05, rel=0.02)
    assert moved[:, 2].std() == pytest.approx(0.02, rel=0.02)
    assert moved[:, 1].std() == pytest.approx(0.5 * 0.02, rel=0.02)


def test_a_vague_start_takes_more_particles_and_parts_than_a_sure_belief() -> None:
    mission = load_mission("museum-walls", [MCL, "run.time_limit_s=5"], 0)
    trace = simulate(mission).finished.robots[0].trace
    assert trace["scan_parts"][0] > 3
    assert trace["particles"][-1] < 2000
    assert trace["scan_parts"][10:].max() <= 3


@pytest.mark.parametrize("seed", [0, 1])
def test_it_tracks_the_route(seed: int) -> None:
    (run,) = simulate(load_mission("museum-walls", [MCL], seed)).finished.robots
    assert run.arrived, run.reason
    error = np.hypot(*(poses(run.trace, "est") - poses(run.trace, "true"))[:, :2].T)
    assert error[20:].max() < 0.05
    assert np.sqrt(np.mean(error[20:] ** 2)) < 0.005


def test_it_tracks_on_an_occupancy_grid() -> None:
    """Where the exact walls are unknown: cells are 5 cm wide, and thin walls are drawn two cells thick."""
    start = Pose2(2.0, 2.0, 0.0)
    told = told_of(start=start, variances=(1e-4, 1e-4, 1e-4))
    chart = WorldMap("room", ROOM.bounds_m, grid=rasterized(ROOM, 0.05))
    told = replace(told, chart=chart)
    localizer = told.localizer(ParticleFilterLocalizer, MclConfig(field_std_m=0.05))
    sim = alone(robot(sensors(), start=start, seed=0))
    for step in range(100):
        belief = localizer.step(sim.step(Twist(0.3, 0.4 if step % 60 < 30 else -0.4)))
        if step > 20:
            assert math.hypot(belief.pose.x_m - sim.truth.x_m, belief.pose.y_m - sim.truth.y_m) < 0.1


@pytest.mark.parametrize("seed", [0, 1])
def test_it_keeps_along_a_corridor_what_its_wheels_tell(seed: int) -> None:
    """Its walls say nothing of how far along it is, and each scan of them made it forget that: metres off."""
    walls = np.array([[0, 0, 70, 0], [70, 0, 70, 2.5], [70, 2.5, 0, 2.5], [0, 2.5, 0, 0]], dtype=float)
    corridor, start = SegmentMap.of(walls), Pose2(15.0, 1.25, 0.0)
    told = told_of(corridor, start=start, variances=(1e-4, 1e-4, 1e-4), seed=seed)
    told = replace(told, chart=WorldMap("corridor", corridor.bounds_m, grid=rasterized(corridor, 0.05)))
    localizer = told.localizer(ParticleFilterLocalizer, MclConfig())
    sim = alone(robot(sensors(), start=start, seed=seed), chart=walled(corridor))
    dead_reckoned_m = 0.0
    for _ in range(700):
        readings = sim.step(Twist(0.5, 0.0))
        odometry = readings.by_sensor["odometry"]
        assert isinstance(odometry, OdometryIncrement)
        dead_reckoned_m += odometry.distance_m
        belief = localizer.step(readings)
    assert belief.status is BeliefStatus.LOCALIZED
    off_m = abs(start.x_m + dead_reckoned_m - sim.truth.x_m)
    assert abs(belief.pose.x_m - sim.truth.x_m) < off_m + 0.05
    assert math.sqrt(belief.cov[0, 0]) < 0.2


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_wheels_that_tell_no_sign_lead_nobody_astray(seed: int) -> None:
    """Freiburg 079's odometry tells a robot that reverses to drive forwards: a metre off in two seconds."""
    told = told_of(start=Pose2(6.0, 4.0, 0.0), variances=(1e-4, 1e-4, 1e-4), seed=seed)
    localizer = told.localizer(ParticleFilterLocalizer, MclConfig())
    sim = alone(robot(sensors(), start=Pose2(6.0, 4.0, 0.0), seed=seed))
    wrong = localized = 0
    for step in range(120):
        readings = sim.step(Twist(-0.5 if 20 <= step < 60 else 0.5, 0.3))
        odometry = readings.by_sensor["odometry"]
        assert isinstance(odometry, OdometryIncrement)
        unsigned = replace(odometry, distance_m=abs(odometry.distance_m))
        belief = localizer.step(replace(readings, by_sensor={**readings.by_sensor, "odometry": unsigned}))
        off = belief.pose.as_array() - sim.truth.as_array()
        off[2] = (off[2] + math.pi) % (2.0 * math.pi) - math.pi
        assert math.hypot(off[0], off[1]) < 0.2
        localized += belief.status is BeliefStatus.LOCALIZED
        far = float(off @ np.linalg.solve(belief.cov, off)) > 16.3
        wrong += belief.status is BeliefStatus.LOCALIZED and far
    assert wrong <= 5
    assert localized >= 30
    assert math.hypot(off[0], off[1]) < 0.05


def test_who_stands_in_doubt_does_not_spread() -> None:
    """Scans of one that stands are not taken in: each widened the cloud once more, while it stood."""
    start = Pose2(6.0, 4.0, 0.0)
    told = told_of(start=start, variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(ParticleFilterLocalizer, MclConfig())
    scan = LidarScan(np.full(539, 3.0))
    for step in range(60):
        if step == 20:  # it has stood for long enough
            prior = start.as_array(), np.diag([1e-6, 1e-6, 1e-6])
            localizer._doubt.tell(2.0, prior, prior[0] + np.array([0.1, 0.0, 0.0]), 0.0, 0.0)
        odometry = OdometryIncrement(0.0, 0.0, 0.0)
        belief = localizer.step(Readings(0.1 * (step + 1), {"lidar": scan, "odometry": odometry}))
        if step > 20:
            assert math.hypot(math.sqrt(belief.cov[0, 0]), math.sqrt(belief.cov[1, 1])) < 0.15


def test_who_is_never_contradicted_keeps_the_belief_in_its_wheels() -> None:
    """Corrections as large as the belief says leave it alone; one beyond chance tells how far, and fades."""
    rng, doubt = np.random.default_rng(0), OdometryDoubt()
    prior = np.array([1.0, 2.0, math.pi / 2.0]), np.diag([1e-4, 4e-4, 1e-4])
    for _ in range(1000):
        doubt.tell(0.0, prior, rng.multivariate_normal(prior[0], 0.7 * prior[1]), 0.1, 0.0)
    assert doubt.stds is None
    doubt.tell(0.0, prior, prior[0] + np.array([0.0, 0.3, 0.0]), 0.1, 0.0)
    assert doubt.stds is not None
    assert doubt.stds == pytest.approx([0.3, 0.03, 0.06], rel=0.02), "ahead is along the map's y"
    for _ in range(20):
        doubt.tell(0.0, prior, prior[0], 0.1, 0.0)
    assert doubt.stds is None
    for _ in range(2):
        doubt.tell(0.0, prior, prior[0] + np.array([0.0, 0.07, 0.0]), 0.1, 0.0)
    assert doubt.stds is not None, "two that alone would be chance"
    assert not doubt.judge(3.0, fits=True)
    assert doubt.judge(3.1, fits=True), "for too long"
    for _ in range(10):
        doubt.judge(3.2, fits=False)
    assert doubt.stds is None, "it is the place that is wrong"
    doubt.tell(0.0, prior, prior[0] + np.array([0.0, 0.3, 0.0]), 0.1, 0.0)
    assert doubt.stds is None
    doubt.forget()
    doubt.tell(0.0, prior, prior[0] + np.array([0.0, 0.3, 0.0]), 0.1, 0.0)
    assert doubt.stds is not None
    doubt.forget()
    assert doubt.stds is None


def test_a_scan_without_returns_leaves_the_belief_and_strange_ranges_do_no_harm() -> None:
    told = told_of(ROOM)
    localizer = told.localizer(ParticleFilterLocalizer, MclConfig())
    before = localizer.step(Readings(0.1, {"lidar": LidarScan(np.full(539, 20.0))}))
    assert told.said["scan_parts"] == 0
    for ranges in (np.full(539, np.nan), np.full(539, np.inf), np.zeros(539)):
        after = localizer.step(Readings(0.2, {"lidar": LidarScan(ranges)}))
        assert np.isfinite(after.cov).all()
        assert np.linalg.eigvalsh(after.cov).min() > 0.0
    assert before.pose.x_m == pytest.approx(2.0, abs=0.05)
    assert localizer.particles.shape[1] == 3


def test_misuse_is_told() -> None:
    nothing = SegmentMap(np.zeros((0, 4)), np.zeros((0, 3)), (0.0, 0.0, 5.0, 5.0))
    with pytest.raises(InputError, match="expected walls or blocked cells on the robot's map, found none"):
        told_of(nothing).localizer(ParticleFilterLocalizer, MclConfig())
    with pytest.raises(InputError, match="at least least_particles"):
        told_of().localizer(ParticleFilterLocalizer, MclConfig(least_particles=500, most_particles=100))
    with pytest.raises(InputError, match=r"world\.map"):
        LOCALIZERS.configure("particle-filter", {"grid_file": "office.yaml"}, "stack.localizer")


def room_of_faces(thick_m: float) -> list[list[float]]:
    """A room's inner face and, if it has any thickness, its outer one."""
    out = []
    for more in (0.0, thick_m)[: 1 + (thick_m > 0.0)]:
        x0, y0, x1, y1 = -more, -more, 5.0 + more, 8.0 + more
        out += [[x0, y0, x1, y0], [x1, y0, x1, y1], [x1, y1, x0, y1], [x0, y1, x0, y0]]
    return out


def test_a_wall_is_thin_where_its_other_face_is_near() -> None:
    one, two = (np.array(room_of_faces(thick_m)) for thick_m in (0.0, 0.04))
    assert thin_share(one, 0.1) == 0.0
    assert thin_share(two, 0.1) > 0.95
    assert thin_share(two, 0.03) == 0.0
    # In pieces, and crossed by others, no wall is thicker or thinner.
    halves = np.vstack([np.column_stack([one[:, :2], one.reshape(-1, 2, 2).mean(axis=1)]), one])
    assert thin_share(halves, 0.1) == 0.0
    assert thin_share(np.array([[0.0, 0.0, 2.0, 0.0], [1.0, -1.0, 1.0, 1.0]]), 0.1) == 0.0
    assert thin_share(np.zeros((0, 4)), 0.1) == 0.0


@pytest.mark.parametrize("seed", [1, 2])
def test_beams_that_are_vaguer_than_a_wall_is_thick_leave_it_honest(seed: int) -> None:
    """Ends beyond the face they met lie nearer to the other one: 2 cm off, and sure of 5 mm (NEES 33)."""
    values = load_mission("museum-walls").model_dump(mode="json")
    values["world"] |= {
        "map": {"map": "room", "walls_m": room_of_faces(0.04)},
        "start": {"x_m": 3.5, "y_m": 1.0, "theta_rad": 0.0},
        "goal": None,
        "landmarks": None,
    }
    lidar = {"name": "lidar", "rate_hz": 5, "beams": 539, "field_of_view_rad": 6.28, "max_range_m": 5.0}
    values["robot"]["sensors"] = {
        "odometry": {"name": "wheel-odometry", "rate_hz": 10},
        "lidar": lidar | {"range_var_m2": 0.0009},
    }
    values["stack"] |= dict.fromkeys(("planner", "local_planner", "controller", "reactive", "escape"))
    values["stack"] |= {
        "navigator": {"name": "open-loop", "speed_m_s": 0.3, "turn_rate_rad_s": 0.4, "duration_s": 60.0},
        "localizer": {"name": "particle-filter"},
    }
    values |= {
        "mission": "thin",
        "task": {"name": "drive"},
        "run": {"dt_s": 0.1, "time_limit_s": 60, "seed": seed},
    }
    metrics = run_mission(mission_of(values), save=False).metrics
    assert metrics["collisions"] == 0
    assert float(str(metrics["nees_mean"])) < 4.0
    assert float(str(metrics["silently_wrong_s"])) < 2.0
