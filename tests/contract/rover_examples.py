"""Examples of what a rover on terrain runs: pose controllers and estimators of its log."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.maps.landmarks import Landmarks
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.rover_drive import drive
from pilotage.sim.rover_sensing import landmark_log
from pilotage.stack.interface import Belief

LANDMARKS = Landmarks(np.array([7, 3]), np.array([[60.0, 40.0], [20.0, -50.0]]))
ODOMETER = WheelOdometryConfig(
    distance_var_m2_per_m=4e-5, angle_var_rad2_per_rad=0.0, angle_var_rad2_per_m=1.9e-6
)
SEER = BeaconConfig(
    field_of_view_rad=2.0 * math.pi, max_range_m=100.0, range_var_m2=0.01, bearing_var_rad2=1.9e-5
)


def bend(steps: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(N, 3) a gentle bend, 0.4 m a step."""
    theta = 0.002 * np.arange(steps + 1)
    x = np.concatenate([[0.0], np.cumsum(0.4 * np.cos(theta[:-1]))])
    y = np.concatenate([[0.0], np.cumsum(0.4 * np.sin(theta[:-1]))])
    return np.column_stack([x, y, theta])


def estimator_estimates(factory: Any, config: Any) -> None:
    """Within 5 sigma of the truth at every step; the initial belief and the log are left alone."""
    truth = bend(400)
    log = landmark_log(truth, ("odometer", ODOMETER), ("lidar", SEER), LANDMARKS, RandomStreams(4))
    initial = Belief(Pose2(0.5, -0.3, 0.004), np.diag([1.0, 1.0, 1e-4]))
    before = initial.cov.copy()
    found = factory(config).estimate(initial, log, LANDMARKS, SEER)
    assert (initial.cov == before).all()
    assert found.poses.shape == (400, 3)
    assert found.covs.shape == (400, 3, 3)
    assert np.linalg.eigvalsh(found.covs).min() > 0.0
    assert (found.covs == found.covs.transpose(0, 2, 1)).all()
    error = np.hypot(*(found.poses[:, :2] - truth[1:, :2]).T)
    sigma = np.sqrt(np.linalg.eigvalsh(found.covs[:, :2, :2])[:, -1])
    assert (error < 5.0 * sigma).all()
    again = factory(config).estimate(initial, log, LANDMARKS, SEER)
    assert (again.poses == found.poses).all()


def pose_controller_arrives(factory: Any, config: Any) -> None:
    """From beside the goal and facing away it ends at the goal with the goal's heading."""
    controller = factory(config, Pose2(30.0, 20.0, 1.0))
    driven = drive(controller.command, controller.distance_m, Pose2(0.0, 0.0, 2.0), 10.0, 0.001, 100_000.0)
    assert driven.arrived
    x, y, theta = driven.poses[-1]
    assert math.hypot(x - 30.0, y - 20.0) <= 0.001
    assert abs(math.remainder(theta - 1.0, 2.0 * math.pi)) < 1e-2
