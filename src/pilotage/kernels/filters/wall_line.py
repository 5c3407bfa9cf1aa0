"""The measurement model of a straight wall in normal form, seen from a mounted sensor."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def wall_line(
    pose: FloatArray, mount: FloatArray, wall: FloatArray, alpha_seen: float, z: FloatArray, H: FloatArray
) -> None:
    """Fill z (2,) = rho and alpha of a wall in the sensor's frame and its Jacobian H (2, 3) in the pose.

    ``wall`` (2,) holds rho and alpha in the map frame, ``mount`` (3,) the sensor's pose in the base. A
    line has two normals; the one nearer ``alpha_seen`` is taken, so rho is negative where the sensor
    stands on the other side of the wall than it seems. For a sensor at the robot's centre this is linear
    in the pose: rho = d - n.(x, y), alpha = A - theta (Arras & Siegwart 1997, eq. 15 for the form).
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    ox, oy = c * mount[0] - s * mount[1], s * mount[0] + c * mount[1]
    nx, ny = math.cos(wall[1]), math.sin(wall[1])
    rho = wall[0] - nx * (pose[0] + ox) - ny * (pose[1] + oy)
    alpha = wall[1] - pose[2] - mount[2]
    if math.cos(alpha - alpha_seen) < 0.0:
        rho, alpha, nx, ny = -rho, alpha + math.pi, -nx, -ny
    z[0] = rho
    z[1] = wrap(alpha)
    H[0, 0] = -nx
    H[0, 1] = -ny
    H[0, 2] = nx * oy - ny * ox
    H[1, 0] = 0.0
    H[1, 1] = 0.0
    H[1, 2] = -1.0


@kernel
def wall_innovation(
    pose: FloatArray,
    mount: FloatArray,
    wall: FloatArray,
    seen: FloatArray,
    z: FloatArray,
    H: FloatArray,
    innovation: FloatArray,
) -> None:
    """Fill ``innovation`` (2,) of a seen line (rho, alpha), with prediction z and Jacobian H beside it."""
    wall_line(pose, mount, wall, seen[1], z, H)
    innovation[0] = seen[0] - z[0]
    innovation[1] = wrap(seen[1] - z[1])


@kernel
def innovation_distance(cov: FloatArray, H: FloatArray, innovation: FloatArray, R: FloatArray) -> float:
    """Squared Mahalanobis distance v' S^-1 v of v (2,), S = H P H' + R, H (2, 3); nan for no positive S."""
    S = np.empty((2, 2))
    for a in range(2):
        for b in range(2):
            total = R[a, b]
            for i in range(3):
                for j in range(3):
                    total += H[a, i] * cov[i, j] * H[b, j]
            S[a, b] = total
    determinant = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    if not determinant > 0.0:
        return math.nan
    u, v = innovation[0], innovation[1]
    return float((u * u * S[1, 1] - u * v * (S[0, 1] + S[1, 0]) + v * v * S[0, 0]) / determinant)
