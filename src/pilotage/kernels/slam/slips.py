"""What an alignment tells, and how far a scan may have slipped where it tells nothing."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.align import solve3
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.local_map import PRIOR

CHANCE = 0.03
"""Part of the weights of an alignment's points that tells nothing: their lines' directions are not exact, so
that even a bare wall seems to hold a scan along its course."""
SLIP_SHARE, SLIP_M = 0.15, 0.4
"""A match as far as SLIP_M from its guess may be off by as much; a nearer one by that share and less."""


@kernel
def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Product of two matrices (3, 3), for which a library takes longer to be called."""
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@kernel
def _is_definite(a: FloatArray) -> bool:
    """Whether a symmetric matrix (3, 3) is positive definite, by its leading minors."""
    minor = a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]
    left = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    right = a[0, 0] * a[1, 2] - a[0, 1] * a[0, 2]
    return bool(a[0, 0] > 0.0 and minor > 0.0 and a[0, 2] * left - a[1, 2] * right + a[2, 2] * minor > 0.0)


@kernel
def told_by(hessian: FloatArray, weight: float) -> FloatArray:
    """(3, 3) of an alignment's Hessian what does not come by chance; ``weight``: the sum of its points'."""
    system = hessian.copy()
    system[0, 0] -= CHANCE * weight
    system[1, 1] -= CHANCE * weight
    if _is_definite(system):
        return system
    told, axes = np.linalg.eigh(system)
    out = np.zeros((3, 3))
    for m in range(3):
        for a in range(3):
            for b in range(3):
                out[a, b] += max(told[m], 0.0) * axes[a, m] * axes[b, m]
    return out


@kernel
def add_slip(
    total: FloatArray,
    held: FloatArray,
    start: FloatArray,
    pose: FloatArray,
    hessian: FloatArray,
    weight: float,
    error: float,
    by_chance: bool,
) -> None:
    """Add what a scan may have slipped, in its own frame.

    Parameters
    ----------
    total, held
        (3, 3) covariance, and (3, 3) square root of one of what is the same from scan to scan.
    start, pose, hessian, weight
        (3,), (3,) and (3, 3) of the alignment, and the sum of its points' weights.
    error, by_chance
        Usual error of the guess it began from, which is all that tells where the alignment leaves the pose
        open; and whether it errs by chance, not the same all along.
    """
    off = between(start, pose)
    far, turned = math.hypot(off[0], off[1]), abs(off[2])
    moved = (SLIP_SHARE * far) ** 2 + (far * far / SLIP_M) ** 2
    total[0, 0] += moved
    total[1, 1] += moved
    total[2, 2] += (SLIP_SHARE * turned) ** 2 + (turned * turned / (0.5 * SLIP_M)) ** 2
    turn = np.eye(3)
    turn[0, 0] = turn[1, 1] = math.cos(pose[2])
    turn[1, 0] = math.sin(pose[2])
    turn[0, 1] = -turn[1, 0]
    told = told_by(_product(turn.T, _product(hessian, turn)), weight)
    # Squared: what the map holds, however weakly, does not add up from scan to scan.
    share = np.empty((3, 3))
    for a in range(3):
        solve3(told + PRIOR, PRIOR[:, a], share[:, a])
    left = error * _product(share, share)
    if by_chance:
        total += _product(left, left.T)
    else:
        held += left
