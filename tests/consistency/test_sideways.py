"""Bases that drive sideways: are the localizers as good as they say by their odometry alone?

Seeds are fixed; a right filter's mean NEES over 80 independent drives leaves the band with a probability of
1e-4 on fresh ones.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from pilotage.core.types import Pose2, Twist
from pilotage.evaluation.consistency import nees
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.localization.localizer import LOCALIZERS
from support import worlds
from support.robots import sensors, told_of

DRIVES, STEPS, DT_S = 80, 120, 0.1
START = Pose2(4.0, 3.0, 0.4)
SURE = (1e-8, 1e-8, 1e-8)
FALSE_ALARM = 1e-4
BY_ODOMETRY: tuple[tuple[str, dict[str, Any]], ...] = (
    ("dead-reckoning", {}),
    ("dead-reckoning", {"covariance": "second-order"}),
    ("ekf-landmarks", {}),
    ("ukf-landmarks", {}),
    ("invariant-ekf-landmarks", {}),
    ("particle-filter", {"relocalize": False}),
)


@cache
def drive(seed: int) -> tuple[list[OdometryIncrement], Pose2]:
    """What the odometry said of a weave to the left and back, and where it ended; driven once for all."""
    wheels = {name: config for name, config in sensors().items() if isinstance(config, WheelOdometryConfig)}
    spec = worlds.robot(wheels, OmnidirectionalConfig(), start=START, seed=seed)
    sim = worlds.alone(spec)
    (name,) = wheels
    said = []
    for k in range(STEPS):
        lateral_m_s = 0.5 if k % 60 < 30 else -0.4
        readings = sim.step(Twist(0.1, 0.3 if k < 60 else -0.5, lateral_m_s))
        reading = readings.by_sensor.get(name)
        if isinstance(reading, OdometryIncrement):
            said.append(reading)
    return said, sim.truth


def mean_nees(name: str, parameters: dict[str, Any], *, sideways: bool = True) -> float:
    """Of the last belief, over all drives."""
    truths, beliefs, covs = [], [], []
    (wheels,) = (key for key, config in sensors().items() if isinstance(config, WheelOdometryConfig))
    for seed in range(DRIVES):
        said, truth = drive(seed)
        told = told_of(start=START, variances=SURE, seed=seed)
        entry = LOCALIZERS.entry(name)
        localizer = told.localizer(entry.factory, entry.config(**parameters))
        for k, reading in enumerate(said, start=1):
            heard = reading if sideways else replace(reading, lateral_m=0.0)
            belief = localizer.step(Readings(k * DT_S, {wheels: heard}))
        truths.append(truth.as_array())
        beliefs.append(belief.pose.as_array())
        covs.append(belief.cov)
    return float(nees(np.array(truths), np.array(beliefs), np.array(covs)).mean())


@pytest.mark.parametrize(("name", "parameters"), BY_ODOMETRY)
def test_sideways_by_odometry_alone(name: str, parameters: dict[str, Any]) -> None:
    low, high = (float(chi2.ppf(p, 3 * DRIVES)) / DRIVES for p in (FALSE_ALARM / 2, 1 - FALSE_ALARM / 2))
    assert low < mean_nees(name, parameters) < high


def test_who_does_not_hear_of_it_is_found_out() -> None:
    assert mean_nees("dead-reckoning", {}, sideways=False) > 100.0
