"""The kernels' models with new arrays out, as tests ask them."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import sighting
from pilotage.kernels.filters import wall_line as wall_kernels
from pilotage.kernels.geometry import motion
from pilotage.models.odometry import OdometryModel


def move(pose: Pose2, distance_m: float, angle_rad: float, model: OdometryModel) -> Pose2:
    """Return the pose after driving ``distance_m`` along an arc that turns by ``angle_rad``."""
    step = motion.exact_arc if model is OdometryModel.EXACT_ARC else motion.mid_angle
    return Pose2(*step(pose.x_m, pose.y_m, pose.theta_rad, distance_m, angle_rad))


def move_jacobians(
    pose: Pose2, distance_m: float, angle_rad: float, model: OdometryModel
) -> tuple[FloatArray, FloatArray]:
    """Return the Jacobians of ``move``: F (3, 3) in the pose, G (3, 2) in distance and angle."""
    F, G = np.empty((3, 3)), np.empty((3, 2))
    motion.arc_jacobians(pose.theta_rad, distance_m, angle_rad, model is OdometryModel.EXACT_ARC, F, G)
    return F, G


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
    wall_kernels.wall_line(pose.as_array(), arm, wall, alpha_seen_rad, z, H)
    return z, H
