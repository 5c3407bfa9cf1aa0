"""Local controllers correct their odometry by scans, by no more than it may be off."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.stack.control.local.role import LocalLimits, LocalView
from pilotage.stack.control.local.rolling import RollingGround
from pilotage.stack.control.local.rolling_config import RollingConfig

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
LIMITS = LocalLimits(2.0, 0.5, 3.0, 3.0, 4.0, 6.0)
ANGLES = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 720)
DEAD_END = np.array([[-1.6, -0.36, 0.76, -0.36], [0.76, -0.36, 0.76, 0.36], [0.76, 0.36, -1.6, 0.36]])


def _view(t_s: float, true: Pose2, told: Pose2, rng: np.random.Generator, var: float) -> LocalView:
    """A laser with 1 cm of noise in a dead end."""
    x, y = true.x_m + 0.12 * math.cos(true.theta_rad), true.y_m + 0.12 * math.sin(true.theta_rad)
    step = float(ANGLES[1] - ANGLES[0])
    ranges: FloatArray = fan_ranges(
        x, y, true.theta_rad + float(ANGLES[0]), step, ANGLES.size, 20.0, DEAD_END, np.zeros((0, 3))
    ) + 0.01 * rng.standard_normal(ANGLES.size)
    return LocalView(
        t_s, told, Twist(0.2, 0.0), ranges, ANGLES, Pose2(0.12, 0.0, 0.0), 20.0, (-3.0, 3.0), LIMITS, JACKAL,
        speed_var_m2_s2=var, turn_rate_var_rad2_s2=var,
    )  # fmt: skip


def test_who_stands_does_not_drift() -> None:
    """For a minute, its walls a hand's breadth beside it: by 4 cm and 0.06 rad it did."""
    ground, rng, here = RollingGround(RollingConfig()), np.random.default_rng(3), Pose2(0.36, 0.03, -0.45)
    for k in range(1200):
        scene = ground.update(_view(0.05 * k, here, here, rng, 0.0))
    assert np.array_equal(scene.pose, here.as_array())


def test_an_odometry_is_corrected_by_what_its_data_sheet_lets_it_be_off() -> None:
    """It goes straight and says so; what scans made of that was off by 0.03 rad after half a metre."""

    def off_rad(var: float, seed: int) -> float:
        ground, rng = RollingGround(RollingConfig()), np.random.default_rng(seed)
        for k in range(60):
            here = Pose2(0.0085 * k, 0.03, -0.02)
            scene = ground.update(_view(0.05 * k, here, here, rng, var))
        return abs(float(scene.pose[2]) + 0.02)

    good, unknown = (np.mean([off_rad(var, seed) for seed in range(5)]) for var in (1e-5, 0.0))
    assert good < 0.5 * unknown


def test_few_beams_along_walls_pull_nobody_back() -> None:
    """Of sixty beams in a hall each had its partner where one ended before, farther back along the wall."""
    angles = np.linspace(-math.pi, math.pi, 60, endpoint=False)
    hall = np.array([[-2, -2, 8, -2], [8, -2, 8, 2], [8, 2, -2, 2], [-2, 2, -2, -2]], dtype=float)
    step, behind_m = float(angles[1] - angles[0]), []
    for seed in range(6):
        ground, rng = RollingGround(RollingConfig()), np.random.default_rng(seed)
        for k in range(60):
            here = Pose2(0.08 * k, 0.1, 0.0)
            ranges = fan_ranges(here.x_m, here.y_m, float(angles[0]), step, 60, 20.0, hall, np.zeros((0, 3)))
            view = LocalView(
                0.1 * k, here, Twist(0.8, 0.0), ranges + 0.01 * rng.standard_normal(60), angles,
                Pose2(0.0, 0.0, 0.0), 20.0, (7.0, 0.0), LIMITS, JACKAL, speed_var_m2_s2=2e-3,
                turn_rate_var_rad2_s2=2e-3,
            )  # fmt: skip
            scene = ground.update(view)
        behind_m.append(here.x_m - float(scene.pose[0]))
    assert abs(np.mean(behind_m)) < 0.1
