"""Distance and direction of a wall from a mounted sensor, with the Jacobian in the robot's pose."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import wall_line as kernels


def wall_line(
    pose: Pose2, wall_rho_alpha: FloatArray, mount: FloatArray, alpha_seen_rad: float
) -> tuple[FloatArray, FloatArray]:
    """Return z (2,) = rho in m and alpha in rad of a wall in the sensor's frame, and its Jacobian H (2, 3).

    Parameters
    ----------
    wall_rho_alpha
        (2,) the wall's normal form in the map frame.
    mount
        (3,) x, y, theta of the sensor in the base frame.
    alpha_seen_rad
        Direction of the normal as it was seen; of the line's two normals the nearer one is taken, so rho
        is negative where the sensor stands on the wall's other side.
    """
    z, H = np.empty(2), np.empty((2, 3))
    wall = np.asarray(wall_rho_alpha, dtype=np.float64)
    arm = np.asarray(mount, dtype=np.float64)
    kernels.wall_line(pose.as_array(), arm, wall, alpha_seen_rad, z, H)
    return z, H
