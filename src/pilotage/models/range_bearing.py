"""Range and bearing of a landmark from a mounted sensor, with the Jacobian in the robot's pose."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import sighting


def range_bearing(pose: Pose2, landmark_xy_m: FloatArray, mount: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return z (2,) = range in m and bearing in rad, and its Jacobian H (2, 3) in x, y, theta.

    Parameters
    ----------
    landmark_xy_m
        (2,) position of the landmark in the map frame.
    mount
        (3,) x, y, theta of the sensor in the base frame.

    Raises
    ------
    ValueError
        Where the landmark coincides with the sensor: its bearing is undefined there.
    """
    z, H = np.empty(2), np.empty((2, 3))
    point = np.asarray(landmark_xy_m, dtype=np.float64)
    arm = np.asarray(mount, dtype=np.float64)
    if not sighting.range_bearing(pose.as_array(), point[0], point[1], arm, z, H):
        raise ValueError("range_bearing: the landmark coincides with the sensor, its bearing is undefined")
    return z, H
