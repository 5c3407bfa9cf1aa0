"""Consistency of the rover's estimators on a made-up drive, and filters that are off and must fail.

False-alarm rates: NEES of 60 runs at a few steps is chi-square with 180 degrees of freedom over 60; a band of
99.99 % at each of four steps alarms falsely in fewer than 1 of 2000 draws of the seeds. Regions of
dead reckoning: over 400 runs, bounds at 4 standard errors and a hundredth for what second order leaves out.
"""

from __future__ import annotations

import cmath
import math
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.position_region import outlines, squared_off
from pilotage.kernels.filters import bent_region, ekf, rover_filter, rover_odometry
from pilotage.kernels.filters.sighting import Known, Seen
from pilotage.kernels.jit import kernel
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.odometry import chord
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.invariant_ekf import InvariantEkfConfig, InvariantEkfLocalizer

# Steps of 4 m: the noise of ten of the report's steps in one, so that few steps make a long way.
DISTANCE_VAR_M2_PER_M, TURN_VAR_RAD2_PER_M = 4e-5, 1.9038589e-6
RANGE_VAR_M2, BEARING_VAR_RAD2, REACH_M = 0.01, 1.9038589e-5, 500.0
STEP_M = 4.0
INITIAL = np.array([36.0, 36.0, math.radians(1.0) ** 2])
STEPS = 2000


def way() -> FloatArray:
    """(N, 3) 8 km in a wide bend."""
    theta = 0.9 * np.linspace(0.0, 1.0, STEPS + 1) ** 2
    x = np.concatenate([[0.0], np.cumsum(STEP_M * np.cos(theta[:-1]))])
    y = np.concatenate([[0.0], np.cumsum(STEP_M * np.sin(theta[:-1]))])
    return np.column_stack([x, y, theta])


TRUTH = way()
# One landmark at a time, and more than a kilometre without any: the hard case for a filter.
IDS: IntArray = np.arange(4)
POINTS: FloatArray = TRUTH[[250, 750, 1250, 1750], :2] + np.array([120.0, -210.0])
NOISE: FloatArray = np.diag([RANGE_VAR_M2, BEARING_VAR_RAD2])
GATE = chi_square_quantile(0.9999, 2)


def drawn(seed: int, turn_noisier: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """A believed start (3,), and what the odometer says of each step (N, 2): distance and turn."""
    streams = RandomStreams(seed)
    start = TRUTH[0] + np.sqrt(INITIAL) * streams.stream("initial").standard_normal(3)
    noise = streams.stream("sensor/odometer").standard_normal((2, STEPS))
    spread = np.sqrt(STEP_M * np.array([DISTANCE_VAR_M2_PER_M, turn_noisier * TURN_VAR_RAD2_PER_M]))
    said = np.column_stack([np.full(STEPS, STEP_M), np.diff(TRUTH[:, 2])]) + noise.T * spread
    return start, said


def sighted(seed: int) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Where each step's sightings end among all (N,), and all ids, ranges and bearings in turn."""
    rng = RandomStreams(seed).stream("sensor/lidar")
    offsets = POINTS - TRUTH[1:, None, :2]
    away = np.hypot(offsets[..., 0], offsets[..., 1])
    steps, rows = np.nonzero(away <= REACH_M)
    noise = np.empty((2, steps.size))
    ends = np.cumsum(np.bincount(steps, minlength=STEPS))
    for begin, end in zip(np.concatenate([[0], ends[:-1]]), ends, strict=True):
        noise[0, begin:end] = rng.standard_normal(end - begin)
        noise[1, begin:end] = rng.standard_normal(end - begin)
    seen = offsets[steps, rows]
    bearings = np.arctan2(seen[:, 1], seen[:, 0]) - TRUTH[1:, 2][steps]
    return (
        ends,
        IDS[rows],
        away[steps, rows] + math.sqrt(RANGE_VAR_M2) * noise[0],
        wrap_array_to_pi(bearings + math.sqrt(BEARING_VAR_RAD2) * noise[1]),
    )


@kernel
def follow(
    second_order: bool,
    pose: FloatArray,
    said: FloatArray,
    ends: IntArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    q: FloatArray,
    start: FloatArray,
    places: FloatArray,
    noise: FloatArray,
    gate: float,
    poses: FloatArray,
    covs: FloatArray,
) -> None:
    """Fill (N, 3) poses and (N, 3, 3) covariances after each step; ``q``: variances of distance and turn."""
    cov, mean, spread = start.copy(), pose.copy(), start.copy()
    refused, anchor = np.zeros(1, np.int64), np.full(1, -1)
    known = np.arange(places.shape[0])
    begin = 0
    for k in range(said.shape[0]):
        part = slice(begin, ends[k])
        begin = ends[k]
        if second_order:
            rover_filter.predict(pose, cov, anchor, said[k, 0], 0.0, said[k, 1], q[0], q[1])
            rover_filter.update(
                pose,
                cov,
                anchor,
                ids[part],
                ranges[part],
                bearings[part],
                known,
                places,
                noise,
                gate,
                refused,
            )
            rover_filter.moments(pose, cov, anchor, places, mean, spread)
            poses[k], covs[k] = mean, spread
        else:
            rover_odometry.predict_first_order(pose, cov, said[k, 0], 0.0, said[k, 1], q[0], q[1])
            seen = Seen(ids[part], ranges[part], bearings[part])
            ekf.update_range_bearings(pose, cov, seen, Known(known, places), np.zeros(3), noise, gate)
            poses[k], covs[k] = pose, cov


FEW = 20
"""Runs that are enough to find a wrong filter out; the right one passes on them, too."""


@cache
def filtered(seed: int, second_order: bool, claimed: float) -> FloatArray:
    """(4,) NEES of one run at the steps ``AT``; ``claimed`` scales the odometry variances it believes."""
    pose, said = drawn(seed)
    q = claimed * STEP_M * np.array([DISTANCE_VAR_M2_PER_M, TURN_VAR_RAD2_PER_M])
    poses, covs = np.empty((STEPS, 3)), np.empty((STEPS, 3, 3))
    follow(second_order, pose, said, *sighted(seed), q, np.diag(INITIAL), POINTS, NOISE, GATE, poses, covs)
    truth = TRUTH[1:][AT]
    truth[:, 2] = wrap_array_to_pi(truth[:, 2])
    return nees(truth, poses[AT], covs[AT])


def mean_nees(second_order: bool = True, claimed: float = 1.0, runs: int = 60) -> FloatArray:
    return np.asarray(np.mean([filtered(seed, second_order, claimed) for seed in range(runs)], axis=0))


AT = [300, 600, 800, 1980]
"""In sight of the first landmark, on the way to the second, past it, and after the last."""


def inside(values: FloatArray, runs: int = 60) -> list[bool]:
    low, high = (float(chi2.ppf(share, 3 * runs)) / runs for share in (5e-5, 1.0 - 5e-5))
    return [bool(low < value < high) for value in values.tolist()]


def test_the_filter_on_landmarks_is_consistent() -> None:
    for runs in (60, FEW):
        values = mean_nees(runs=runs)
        assert all(inside(values, runs)), values


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_filter_with_wrong_odometry_variances_is_found_out(factor: float) -> None:
    assert not all(inside(mean_nees(claimed=factor, runs=FEW), FEW))


def test_the_first_order_filter_is_too_sure() -> None:
    assert not all(inside(mean_nees(second_order=False, runs=FEW), FEW))


@kernel
def reckon(
    second_order: bool, pose: FloatArray, said: FloatArray, q: FloatArray, cov: FloatArray, out: FloatArray
) -> None:
    """Fill (N, 19): poses, covariances and, second order, regions after each step, by odometry alone."""
    sums = np.zeros(rover_odometry.SUMS, dtype=np.complex128)
    moves, knots = np.zeros(bent_region.KNOTS, dtype=np.complex128), np.zeros((bent_region.KNOTS, 2))
    spread, count = np.zeros(bent_region.SUMS, dtype=np.complex128), 0
    spread[0] = cov[0, 0] + cov[1, 1]
    for k in range(said.shape[0]):
        if second_order:
            move = cmath.rect(said[k, 0], pose[2])
            count = bent_region.add_move(moves, knots, spread, count, move, cov[2, 2], q[0])
            bent_region.region(moves, knots, spread, count, out[k, 12:])
            rover_odometry.predict_second_order(pose, cov, sums, said[k, 0], 0.0, said[k, 1], q[0], q[1])
        else:
            rover_odometry.predict_first_order(pose, cov, said[k, 0], 0.0, said[k, 1], q[0], q[1])
        out[k, :3], out[k, 3:12] = pose, cov.ravel()


def reckoned(seed: int, second_order: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(N, 3) poses, (N, 3, 3) covariances and (N, 7) regions of one run by odometry alone."""
    # Twice the turn noise, for a heading as uncertain as at the end of the report's 13 km.
    pose, said = drawn(seed, turn_noisier=2.0)
    q = STEP_M * np.array([DISTANCE_VAR_M2_PER_M, 2.0 * TURN_VAR_RAD2_PER_M])
    out = np.empty((STEPS, 12 + bent_region.REGION))
    reckon(second_order, pose, said, q, np.diag(INITIAL), out)
    return out[:, :3], out[:, 3:12].reshape(-1, 3, 3), out[:, 12:]


def test_the_regions_of_dead_reckoning_hold_the_truth_as_often_as_said() -> None:
    """Over the second half of the way, where the heading is uncertain by some degrees.

    Ellipses do not: those of the exact moments hold too much of the middle, linearized ones too little.
    """
    levels = (0.5, 0.8, 0.95, 0.99)
    held = np.empty((3, len(levels), 400))
    for seed in range(400):
        poses, covs, regions = reckoned(seed, True)
        first, linear, _ = reckoned(seed, False)
        for row, (mean, cov, bent) in enumerate(
            ((poses, covs, regions), (poses, covs, None), (first, linear, None))
        ):
            off = squared_off((TRUTH[1:] - mean)[STEPS // 2 :, :2], cov[STEPS // 2 :], _half(bent))
            held[row, :, seed] = [(off <= chi_square_quantile(level, 2)).mean() for level in levels]
    shares, error = held.mean(axis=2), held.std(axis=2) / 20.0
    assert np.all(np.abs(shares[0] - levels) < 4.0 * error[0] + 0.01), shares
    assert shares[1, 0] > 0.5 + 2.0 * error[1, 0]
    assert 0.80 < shares[2, 2] < 0.925


def _half(regions: FloatArray | None) -> FloatArray | None:
    return None if regions is None else regions[STEPS // 2 :]


def test_the_outline_of_a_region_is_where_its_distance_is_the_quantile() -> None:
    poses, covs, regions = reckoned(0, True)
    assert poses.shape == (STEPS, 3)
    for bent in (regions[::500], None):
        for k, line in enumerate(outlines(covs[::500], bent, 0.95)):
            of = np.repeat(regions[::500][k : k + 1], len(line), axis=0)
            off = squared_off(
                line, np.repeat(covs[::500][k : k + 1], len(line), axis=0), of if bent is not None else None
            )
            np.testing.assert_allclose(off, chi_square_quantile(0.95, 2), rtol=1e-6)


def test_the_localizers_are_these_kernels() -> None:
    """A few steps of each localizer give what stepping the kernels by hand gives."""
    odometer = WheelOdometryConfig(
        rate_hz=1.0,
        distance_var_m2_per_m=DISTANCE_VAR_M2_PER_M,
        angle_var_rad2_per_rad=0.0,
        angle_var_rad2_per_m=TURN_VAR_RAD2_PER_M,
    )
    seer = BeaconConfig(rate_hz=1.0, range_var_m2=RANGE_VAR_M2, bearing_var_rad2=BEARING_VAR_RAD2)
    streams = RandomStreams(0)
    sensors = {"odometer": odometer, "lidar": seer}
    robot = RobotKnowledge(Footprint.disc(0.5), DifferentialDriveConfig(), sensors, 100.0, streams)
    chart = WorldMap("open", (-1e4, -1e4, 1e4, 1e4), landmarks=Landmarks(IDS, POINTS))
    initial = Belief(Pose2.from_array(TRUTH[0]), np.diag(INITIAL))
    filter_, journal = (
        InvariantEkfLocalizer(InvariantEkfConfig(), robot, chart, initial, Journal()),
        Journal(),
    )
    reckoning = DeadReckoningLocalizer(
        DeadReckoningConfig(covariance="second-order"), robot, chart, initial, journal
    )
    pose, cov, alone, alone_cov = TRUTH[0].copy(), np.diag(INITIAL), TRUTH[0].copy(), np.diag(INITIAL)
    mean, spread = np.empty(3), np.empty((3, 3))
    sums = np.zeros(rover_odometry.SUMS, dtype=np.complex128)
    moves, knots, count = (
        np.zeros(bent_region.KNOTS, dtype=np.complex128),
        np.zeros((bent_region.KNOTS, 2)),
        0,
    )
    about, bent = np.array([72.0, 0.0, 0.0], dtype=np.complex128), np.empty(bent_region.REGION)
    refused, anchor = np.zeros(1, dtype=np.int64), np.full(1, -1, dtype=np.int64)
    ids, ranges, bearings = IDS[:1], np.array([260.0]), np.array([-0.9])
    # A hundred seconds a step: what the drive could not have done would be believed less.
    for step, turn in enumerate((0.02, -0.01, 0.0), start=1):
        readings = Readings(
            100.0 * step,
            {"odometer": OdometryIncrement(4.0, turn), "lidar": BeaconReadings(ids, ranges, bearings)},
        )
        distance, aside = chord(4.0, turn)
        noise = STEP_M * DISTANCE_VAR_M2_PER_M, STEP_M * TURN_VAR_RAD2_PER_M
        rover_filter.predict(pose, cov, anchor, distance, aside, turn, *noise)
        rover_filter.update(pose, cov, anchor, ids, ranges, bearings, IDS, POINTS, NOISE, GATE, refused)
        rover_filter.moments(pose, cov, anchor, POINTS, mean, spread)
        move = cmath.rect(distance, alone[2] + aside)
        count = bent_region.add_move(moves, knots, about, count, move, alone_cov[2, 2], noise[0])
        bent_region.region(moves, knots, about, count, bent)
        rover_odometry.predict_second_order(alone, alone_cov, sums, distance, aside, turn, *noise)
        belief, reckoned_ = filter_.step(readings), reckoning.step(readings)
        np.testing.assert_allclose(belief.pose.as_array(), mean, rtol=1e-12)
        np.testing.assert_allclose(belief.cov, spread, rtol=1e-12)
        np.testing.assert_allclose(reckoned_.pose.as_array(), alone, rtol=1e-12)
        np.testing.assert_allclose(reckoned_.cov, alone_cov, rtol=1e-12)
        np.testing.assert_allclose(journal.row, bent, rtol=1e-12)


def test_second_order_is_the_mean_square_error_about_the_path_driven() -> None:
    """The covariance along a path without noise against the errors of 20,000 noisy ones, within 4 %."""
    rng, runs, steps, distance = np.random.default_rng(4), 20_000, 60, 10.0
    start, q_distance, q_turn = np.diag([4.0, 1.0, 0.01]), 0.04, 0.0015
    start[0, 2] = start[2, 0] = 0.08
    first = rng.multivariate_normal(np.zeros(3), start, runs)
    turns = 0.03 * np.sin(np.arange(steps) / 7.0)
    pose, cov = np.zeros(3), start.copy()
    sums = np.zeros(rover_odometry.SUMS, dtype=np.complex128)
    sums[4] = complex(start[0, 2], start[1, 2])
    z, w, heading, truth = first[:, 0] + 1j * first[:, 1], first[:, 2].copy(), 0.0, 0j
    for turn in turns.tolist():
        rover_odometry.predict_second_order(pose, cov, sums, distance, 0.0, turn, q_distance, q_turn)
        along = distance + np.sqrt(q_distance) * rng.standard_normal(runs)
        z += along * np.exp(1j * (heading + w))
        truth += distance * np.exp(1j * heading)
        w += np.sqrt(q_turn) * rng.standard_normal(runs)
        heading += turn
    error = np.column_stack([(z - truth).real, (z - truth).imag, w])
    assert abs(complex(pose[0], pose[1]) - truth) < 1e-9
    found, scale = error.T @ error / runs, np.sqrt(np.diag(cov))
    assert found / np.outer(scale, scale) == pytest.approx(cov / np.outer(scale, scale), abs=0.04)
