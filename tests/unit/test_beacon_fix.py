"""A pose from beacons alone, and the filter that asks for it when the gate lets nothing through."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.driving import poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.stack.localization.beacon_fix import fix_from_beacons
from support.models import range_bearing

MOUNT = np.array([0.1, -0.05, 0.3])
R = np.diag([3.4665e-4, 1.1771e-4])
BEACONS = np.array([[0.0, 4.0], [10.0, 2.0], [9.0, 7.0], [3.0, 8.0]])


def sightings(pose: Pose2, beacons: FloatArray) -> FloatArray:
    """Exact ranges and bearings (K, 2)."""
    return np.array([range_bearing(pose, beacon, MOUNT)[0] for beacon in beacons])


@settings(max_examples=100)
@given(st.floats(1, 8), st.floats(0.5, 6), st.floats(-3.1, 3.1), st.integers(2, 4))
def test_exact_sightings_give_the_pose(x: float, y: float, theta: float, count: int) -> None:
    z = sightings(Pose2(x, y, theta), BEACONS[:count])
    found = fix_from_beacons(BEACONS[:count], z[:, 0], z[:, 1], MOUNT, R)
    assert found is not None
    assert found.pose[:2] == pytest.approx([x, y], abs=1e-6)
    assert wrap_to_pi(found.pose[2] - theta) == pytest.approx(0.0, abs=1e-7)
    assert found.chi2 == pytest.approx(0.0, abs=1e-6)
    assert found.dof == 2 * count - 3


def test_its_covariance_is_that_of_its_errors() -> None:
    rng, truth, runs = np.random.default_rng(0), np.array([4.0, 3.0, 1.0]), 400
    exact = sightings(Pose2.from_array(truth), BEACONS)
    normalized, chi2 = [], []
    for _ in range(runs):
        z = exact + rng.standard_normal(exact.shape) * np.sqrt(np.diag(R))
        found = fix_from_beacons(BEACONS, z[:, 0], z[:, 1], MOUNT, R)
        assert found is not None
        off = found.pose - truth
        normalized.append(off @ np.linalg.solve(found.cov, off))
        chi2.append(found.chi2)
    # Means of chi-square variables with 3 and 5 degrees of freedom over 400 draws: 3.3 standard errors, 1e-3.
    assert np.mean(normalized) == pytest.approx(3.0, abs=3.3 * np.sqrt(6 / runs))
    assert np.mean(chi2) == pytest.approx(5.0, abs=3.3 * np.sqrt(10 / runs))


def test_too_few_or_beacons_on_one_spot_fix_nothing() -> None:
    z = sightings(Pose2(4.0, 3.0, 1.0), BEACONS)
    assert fix_from_beacons(BEACONS[:1], z[:1, 0], z[:1, 1], MOUNT, R) is None
    same = BEACONS[[0, 0]]
    assert fix_from_beacons(same, z[[0, 0], 0], z[[0, 0], 1], MOUNT, R) is None


def test_a_false_sighting_shows() -> None:
    z = sightings(Pose2(4.0, 3.0, 1.0), BEACONS)
    z[1, 0] += 1.0
    found = fix_from_beacons(BEACONS, z[:, 0], z[:, 1], MOUNT, R)
    assert found is not None
    assert found.chi2 > 100.0


def last_error_m(mission: str, overrides: list[str], seed: int) -> float:
    """Position error at the end."""
    trace = simulate(load_mission(mission, overrides, seed)).finished.robots[0].trace
    return float(np.hypot(*(poses(trace, "est") - poses(trace, "true"))[-1, :2]))


@pytest.mark.parametrize("name", ["ekf-landmarks", "iekf-landmarks", "ukf-landmarks", "ekf-augmented"])
def test_a_start_four_sigma_off_is_mended(name: str) -> None:
    # Seed 302 draws a heading 4.1 standard deviations off: every beacon is gated away.
    overrides = [f"stack.localizer.name={name}", "run.time_limit_s=5"]
    assert last_error_m("museum-2", overrides, 302) < 0.05
    # Driven by the truth: a robot that says that it is lost would stand and look around instead.
    never = [*overrides, "run.oracles=[driver]", "stack.localizer.doubt_after=null"]
    assert last_error_m("museum-2", never, 302) > 0.5


def test_a_carried_robot_finds_itself_by_its_beacons() -> None:
    overrides = ["stack.localizer.name=ekf-landmarks", "run.time_limit_s=70"]
    found = sum(last_error_m("museum-kidnap", overrides, seed) < 0.1 for seed in range(6))
    assert found >= 5  # where but one beacon is in sight it has to wait
