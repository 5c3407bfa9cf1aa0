"""Lines fitted to scan points: the fit, its covariance, and the lines found in known rooms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.lines.clustering import beam_directions
from pilotage.kernels.lines.fit import fit_line, is_straight, line_covariance
from pilotage.maps.segment_map import SegmentMap, box_segments
from support.walls import RANGE_VAR_M2, extractor, scan_of

ROOM = SegmentMap.of(box_segments(0.0, 0.0, 8.0, 6.0, 0.0))
EXTENT = st.tuples(st.floats(0.5, 15.0), st.floats(-3.1, 3.1), st.floats(-0.9, 0.5), st.floats(0.15, 0.6))


def on_a_line(rho: float, alpha: float, low: float, width: float) -> tuple[FloatArray, FloatArray]:
    """Exact ranges and directions of 40 beams on a line, at angles from low to low + width of its normal."""
    directions = beam_directions(alpha + low, width / 39, 40)
    return rho / (directions @ np.array([math.cos(alpha), math.sin(alpha)])), directions


@settings(max_examples=100)
@given(EXTENT)
def test_the_fit_of_exact_points_is_exact(line: tuple[float, float, float, float]) -> None:
    ranges, directions = on_a_line(*line)
    rho, alpha = fit_line(directions * ranges[:, None], np.arange(40), 40)
    assert rho == pytest.approx(line[0], abs=1e-9)
    assert wrap_to_pi(alpha - line[1]) == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=50)
@given(EXTENT)
def test_the_covariance_is_the_propagated_range_noise(line: tuple[float, float, float, float]) -> None:
    """Against central differences of the fit in every range."""
    ranges, directions = on_a_line(*line)
    index, step = np.arange(40), 1e-5
    J = np.empty((2, 40))
    for k in range(40):
        both = []
        for sign in (1.0, -1.0):
            moved = ranges.copy()
            moved[k] += sign * step
            both.append(np.array(fit_line(directions * moved[:, None], index, 40)))
        J[:, k] = (both[0] - both[1]) / (2 * step)
        J[1, k] = wrap_to_pi(float(both[0][1] - both[1][1])) / (2 * step)
    cov = np.empty((2, 2))
    line_covariance(directions * ranges[:, None], directions, index, 40, line[1], 2.0, cov)
    assert cov == pytest.approx(2.0 * J @ J.T, rel=1e-4, abs=1e-9)


def test_the_covariance_holds_in_a_monte_carlo() -> None:
    # 4000 fits: the sample's normalized error has mean 2 with standard error 2 / sqrt(4000) = 0.032.
    rng = np.random.default_rng(5)
    ranges, directions = on_a_line(4.0, 0.7, -0.8, 1.0)
    index, cov = np.arange(40), np.empty((2, 2))
    errors = np.empty((4000, 2))
    for n in range(4000):
        noisy = ranges + math.sqrt(RANGE_VAR_M2) * rng.standard_normal(40)
        errors[n] = fit_line(directions * noisy[:, None], index, 40)
    line_covariance(directions * ranges[:, None], directions, index, 40, 0.7, RANGE_VAR_M2, cov)
    errors -= np.array([4.0, 0.7])
    errors[:, 1] = wrap_array_to_pi(errors[:, 1])
    assert np.einsum("ni,ij,nj->n", errors, np.linalg.inv(cov), errors).mean() == pytest.approx(2.0, abs=0.11)
    assert np.cov(errors.T) == pytest.approx(cov, rel=0.12)  # five standard errors of a variance
    assert abs(errors.mean(axis=0)) == pytest.approx([0.0, 0.0], abs=5 * math.sqrt(cov.max() / 4000))


def test_straight_lines_pass_and_curves_do_not() -> None:
    rng = np.random.default_rng(6)
    index, passed = np.arange(40), 0
    for _ in range(500):
        ranges, directions = on_a_line(4.0, 0.7, -0.8, 1.0)
        points = directions * (ranges + math.sqrt(RANGE_VAR_M2) * rng.standard_normal(40))[:, None]
        passed += is_straight(
            points, directions, index, 40, *fit_line(points, index, 40), RANGE_VAR_M2, 2.326
        )
    # Nominal 0.99 or more (two parameters are fitted); below 0.975 would come once in 10^3.
    assert passed / 500 >= 0.975
    directions = beam_directions(-0.2, 0.4 / 39, 40)
    arc = directions * 2.0
    assert not is_straight(arc, directions, index, 40, *fit_line(arc, index, 40), RANGE_VAR_M2, 3.7)


def test_a_cluster_around_corners_gives_one_line_a_wall() -> None:
    """From the middle all four walls are one cluster, of which the scanner sees three whole sides."""
    rng = np.random.default_rng(0)
    for seed in range(20):
        pose = Pose2(*rng.uniform([-3, -2, -3], [3, 2, 3]))
        lines = extractor(seed).extract(scan_of(ROOM, pose, rng))
        assert 3 <= len(lines) <= 5  # a wall cut in two by the blind sector is two lines
        for (rho, alpha), cov in zip(lines.rho_alpha, lines.covs, strict=True):
            normal = wrap_to_pi(alpha + pose.theta_rad)
            side = round(normal / (math.pi / 2))
            expected = {0: 4 - pose.x_m, 1: 3 - pose.y_m, 2: 4 + pose.x_m, 3: 3 + pose.y_m}[side % 4]
            error = np.array([rho - expected, wrap_to_pi(normal - side * math.pi / 2)])
            assert error @ np.linalg.solve(cov, error) < 18.4  # 1e-4 of chi-square, two degrees of freedom


def test_ends_lie_on_the_line_and_inside_the_wall() -> None:
    lines = extractor().extract(scan_of(ROOM, Pose2(1.0, 0.5, 0.3), np.random.default_rng(1)))
    for (rho, alpha), ends in zip(lines.rho_alpha, lines.ends_m.reshape(-1, 2, 2), strict=True):
        assert ends @ np.array([math.cos(alpha), math.sin(alpha)]) == pytest.approx([rho, rho], abs=1e-12)
    rotation = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    corners = lines.ends_m.reshape(-1, 2) @ rotation.T + np.array([1.0, 0.5])
    assert (np.abs(corners) <= np.array([4.01, 3.01])).all()


def test_members_are_the_points_near_their_line() -> None:
    lines = extractor().extract(scan_of(ROOM, Pose2(1.0, 0.5, 0.3), np.random.default_rng(1)))
    assert set(lines.members.tolist()) == set(range(-1, len(lines)))
    for k, (rho, alpha) in enumerate(lines.rho_alpha):
        points = lines.points_m[lines.members == k]
        offsets = points @ np.array([math.cos(alpha), math.sin(alpha)]) - rho
        assert np.abs(offsets).max() <= 5.0 * math.sqrt(RANGE_VAR_M2)


def test_a_wall_met_through_a_doorway_does_not_bend_the_line() -> None:
    """A line prolonged beyond its wall's end crosses another wall: that crossing is none of its points."""
    world = SegmentMap.of(np.array([[0.0, 1.0, 3.0, 1.0], [5.0, -1.0, 5.0, 4.0], [3.0, 1.0, 3.0, 4.0]]))
    lines = extractor().extract(scan_of(world, Pose2(1.0, 0.0, 0.5), None))
    ahead = [
        ends for (rho, _), ends in zip(lines.rho_alpha, lines.ends_m, strict=True) if abs(rho - 1.0) < 0.01
    ]
    assert len(ahead) == 1
    assert math.hypot(ahead[0][2] - ahead[0][0], ahead[0][3] - ahead[0][1]) < 3.0


def test_the_same_stream_gives_the_same_lines() -> None:
    ranges = scan_of(ROOM, Pose2(1.0, 0.5, 0.3), np.random.default_rng(1))
    first, second = extractor(4).extract(ranges), extractor(4).extract(ranges)
    assert (first.rho_alpha == second.rho_alpha).all()
    assert (first.covs == second.covs).all()


@pytest.mark.parametrize("value", [0.0, 20.0, math.inf, math.nan])
def test_scans_of_nothing_give_no_lines(value: float) -> None:
    assert len(extractor().extract(np.full(539, value))) == 0
