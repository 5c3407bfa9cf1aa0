"""Is the augmented EKF as good as it says, of the pose and of the errors that it estimates?

Every run draws the sensors' errors from what the filter believes of them. Seeds are fixed; the stated rates
are those at which a right filter would fail on fresh ones.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.stack.localization.ekf_augmented import SystematicErrors
from support.bare_robots import ON_BEACONS
from support.nees_bands import fraction_in_band

RUNS, STEPS, SETTLE = 30, 300, 10
FEW = 10
"""Runs that are enough to find a wrong filter out; a right one passes on them, too."""
PRIOR = SystematicErrors()
STD = {
    "robot.sensors.odometry.distance_scale": PRIOR.distance_scale_var**0.5,
    "robot.sensors.odometry.angle_scale": PRIOR.angle_scale_var**0.5,
    "robot.sensors.odometry.angle_bias_rad_s": PRIOR.angle_bias_var_rad2_s2**0.5,
    "robot.sensors.beacons.bearing_offset_rad": PRIOR.bearing_offset_var_rad2**0.5,
}


@cache
def sample(name: str, *overrides: str, runs: int = RUNS) -> tuple[FloatArray, FloatArray]:
    """NEES of the pose (R, N), and the last errors of the four systematic ones in standard deviations."""
    rows, scores = [], []
    for seed in range(runs):
        rng = np.random.default_rng([seed, 7])
        given = {key: float(rng.normal()) * std for key, std in STD.items()}
        keys = [f"{key}={value + ('scale' in key)!r}" for key, value in given.items()]
        mission = load_mission(
            "museum-route",
            [
                f"stack.localizer.name={name}",
                *keys,
                f"run.time_limit_s={STEPS / 10}",
                *ON_BEACONS,
                *overrides,
            ],
            seed,
        )
        trace = simulate(mission).finished.robots[0].trace
        rows.append(nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))[SETTLE:])
        if name == "ekf-augmented":
            last = {key.rsplit(".", 1)[1]: value + ("scale" in key) for key, value in given.items()}
            scores.append([(trace[k][-1] - v) / trace[f"{k}_std"][-1] for k, v in last.items()])
    return np.array(rows), np.array(scores)


def is_consistent(values: FloatArray) -> bool:
    """Pointwise in the 99.9 % band for 95 % of the steps, and in the mean; false alarm about 2e-3."""
    means = values.mean(axis=1)
    off = abs(means.mean() - 3.0) > 3.7 * means.std(ddof=1) / np.sqrt(len(values))
    return not off and fraction_in_band(values, 3, 0.999) >= 0.95


def test_the_poses_variance_is_that_of_its_errors() -> None:
    assert is_consistent(sample("ekf-augmented")[0])
    assert is_consistent(sample("ekf-augmented")[0][:FEW])


def test_the_systematic_errors_lie_in_their_intervals() -> None:
    # Thirty runs, four errors each: a sum of chi-square variables, four degrees of freedom a run if they were
    # uncorrelated; they nearly are. False alarm 1e-3 an error.
    scores = sample("ekf-augmented")[1]
    for squared in (scores**2).sum(axis=0):
        assert chi_square_quantile(0.0005, RUNS) < squared < chi_square_quantile(0.9995, RUNS)


def test_a_plain_filter_is_overconfident_there() -> None:
    values = sample("ekf-landmarks", runs=FEW)[0]
    assert not is_consistent(values)
    assert values.mean() > 10.0


@pytest.mark.parametrize("key", ["measurement_var_scale", "odometry_var_scale"])
@pytest.mark.parametrize("factor", ["0.5", "2"])
def test_a_filter_that_is_wrong_by_a_factor_of_two_is_found_out(key: str, factor: str) -> None:
    # Odometry that is believed too little shows last: beacons are in sight all the time.
    runs = RUNS if key == "odometry_var_scale" else FEW
    assert not is_consistent(sample("ekf-augmented", f"stack.localizer.{key}={factor}", runs=runs)[0])
