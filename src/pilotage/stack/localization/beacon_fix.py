"""A pose from beacons alone: for a filter that has reason to doubt what it believes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.models.range_bearing import range_bearing

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
    weight = np.kron(np.eye(count), np.linalg.inv(R))
    if _at_a_beacon(pose, points_xy_m, mount):
        return None
    for _ in range(ITERATIONS):
        off, H = _residuals(pose, points_xy_m, ranges_m, bearings_rad, mount)
        information = H.T @ weight @ H
        if not np.linalg.cond(information) < 1e12:
            return None
        step = np.linalg.solve(information, H.T @ weight @ off)
        pose = pose + step
        pose[2] = wrap_to_pi(float(pose[2]))
        if _at_a_beacon(pose, points_xy_m, mount):
            return None
        if float(np.abs(step).max()) < 1e-9:
            break
    off, H = _residuals(pose, points_xy_m, ranges_m, bearings_rad, mount)
    cov = np.asarray(np.linalg.inv(H.T @ weight @ H), dtype=np.float64)
    return BeaconFix(pose, 0.5 * (cov + cov.T), float(off @ weight @ off), 2 * count - 3)


def _at_a_beacon(pose: FloatArray, points: FloatArray, mount: FloatArray) -> bool:
    c, s = np.cos(pose[2]), np.sin(pose[2])
    sensor = pose[:2] + np.array([[c, -s], [s, c]]) @ mount[:2]
    return bool(np.hypot(*(points - sensor).T).min() < AT_A_BEACON_M)


def _residuals(
    pose: FloatArray, points: FloatArray, ranges: FloatArray, bearings: FloatArray, mount: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Measured less predicted (2 K,), range and bearing in turn, and the Jacobian (2 K, 3)."""
    predicted = [range_bearing(Pose2.from_array(pose), point, mount) for point in points]
    z = np.array([entry[0] for entry in predicted])
    off = np.column_stack([ranges - z[:, 0], wrap_array_to_pi(bearings - z[:, 1])])
    return off.ravel(), np.concatenate([entry[1] for entry in predicted])
