"""A pose from beacons alone: for a filter that has reason to doubt what it believes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.kernels.filters import sighting

LEAST_BEACONS = 2
ITERATIONS = 10
AT_A_BEACON_M = 1e-6
"""A sensor nearer to a beacon than this sees no direction."""


@dataclass(frozen=True, slots=True)
class BeaconFix:
    """Pose (3,), its covariance (3, 3), and how badly the beacons fit it.

    ``chi2`` has ``dof`` degrees of freedom, two a beacon less the three of the pose.
    """

    pose: FloatArray
    cov: FloatArray
    chi2: float
    dof: int


def fix_from_beacons(
    points_xy_m: FloatArray, ranges_m: FloatArray, bearings_rad: FloatArray, mount: FloatArray, R: FloatArray
) -> BeaconFix | None:
    """Fit a pose to ranges and bearings (K,) of known beacons (K, 2), without a first guess.

    The beacons as they are seen are laid over the map (rigid fit in closed form, Umeyama 1991), then
    Gauss-Newton on ranges and bearings with their covariance R (2, 2). None with fewer than two beacons, or
    where they stand on one spot or the robot on theirs. A false sighting spoils the fit; ``chi2`` shows it.
    """
    count = points_xy_m.shape[0]
    if count < LEAST_BEACONS:
        return None
    angle = bearings_rad + mount[2]
    seen = mount[:2] + ranges_m[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    a, b = seen - seen.mean(axis=0), points_xy_m - points_xy_m.mean(axis=0)
    theta = float(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)))
    c, s = np.cos(theta), np.sin(theta)
    middle = points_xy_m.mean(axis=0) - np.array([[c, -s], [s, c]]) @ seen.mean(axis=0)
    pose = np.array([middle[0], middle[1], wrap_to_pi(theta)])
    weight = np.linalg.inv(R)
    if _at_a_beacon(pose, points_xy_m, mount):
        return None
    for _ in range(ITERATIONS):
        off, H = _residuals(pose, points_xy_m, ranges_m, bearings_rad, mount)
        weighted = (weight @ H).reshape(-1, 3)
        information = H.reshape(-1, 3).T @ weighted
        if not np.linalg.cond(information) < 1e12:
            return None
        step = np.linalg.solve(information, weighted.T @ off.ravel())
        pose = pose + step
        pose[2] = wrap_to_pi(float(pose[2]))
        if _at_a_beacon(pose, points_xy_m, mount):
            return None
        if float(np.abs(step).max()) < 1e-9:
            break
    off, H = _residuals(pose, points_xy_m, ranges_m, bearings_rad, mount)
    cov = np.asarray(np.linalg.inv(np.einsum("kij,il,klm->jm", H, weight, H)), dtype=np.float64)
    return BeaconFix(pose, 0.5 * (cov + cov.T), float(np.sum((off @ weight) * off)), 2 * count - 3)


def _at_a_beacon(pose: FloatArray, points: FloatArray, mount: FloatArray) -> bool:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    sensor = pose[:2] + np.array([[c, -s], [s, c]]) @ mount[:2]
    return bool(np.hypot(*(points - sensor).T).min() < AT_A_BEACON_M)


def _residuals(
    pose: FloatArray, points: FloatArray, ranges: FloatArray, bearings: FloatArray, mount: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Measured less predicted (K, 2), range and bearing, and the Jacobian (K, 2, 3)."""
    z, H = np.empty((points.shape[0], 2)), np.empty((points.shape[0], 2, 3))
    for k, (x_m, y_m) in enumerate(points):
        sighting.range_bearing(pose, x_m, y_m, mount, z[k], H[k])
    return np.column_stack([ranges - z[:, 0], wrap_array_to_pi(bearings - z[:, 1])]), H
