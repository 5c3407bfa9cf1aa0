"""How far an estimate is from the SLAM benchmark's relations, and whether it knows how far.

For each relation the estimated motion between its two moments is compared with the true one: the length of
the difference of the translations, and the angle of the rotation between them. Their means count, over all
relations (Kuemmerle and others, "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, 2009,
section 4, with absolute errors as in their tables). No alignment is needed, and a drift is counted only over
the relation's own distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.relations import Relations
from pilotage.logs.trajectories import Trajectory3

MAX_TIME_DIFFERENCE_S = 1e-3
"""The benchmark's times are those of scans, printed to microseconds."""
ROUNDING_S = 2e-6


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """Errors of the relations whose moments the estimate has.

    Attributes
    ----------
    used
        (K,) which relations of the file.
    first, second
        (K,) the estimate's poses at their moments.
    translation_m, rotation_rad
        (K,) both at least 0.
    planar
        (K, 3) estimated minus true x, y, yaw of the motion, in the axes of the first pose.
    relations
        How many the file has.
    """

    used: IntArray
    first: IntArray
    second: IntArray
    translation_m: FloatArray
    rotation_rad: FloatArray
    planar: FloatArray
    relations: int

    def summary(self) -> dict[str, float | int]:
        """Means, standard deviations and maxima under their JSON keys."""
        rotation_deg = np.degrees(self.rotation_rad)
        return {
            "relations": int(self.used.size),
            "relations_without_pose": self.relations - int(self.used.size),
            "trans_mean_m": float(self.translation_m.mean()),
            "trans_std_m": float(self.translation_m.std()),
            "trans_max_m": float(self.translation_m.max()),
            "rot_mean_deg": float(rotation_deg.mean()),
            "rot_std_deg": float(rotation_deg.std()),
            "rot_max_deg": float(rotation_deg.max()),
        }


def relation_errors(
    estimate: Trajectory3, relations: Relations, max_difference_s: float = MAX_TIME_DIFFERENCE_S
) -> RelationErrors:
    """Compare an estimate with the relations.

    Parameters
    ----------
    estimate
        The robot's poses with times (not the scanner's: mind its mount).
    max_difference_s
        A relation counts where the estimate has poses this near to both its moments; how many have none
        is told in the result.

    Raises
    ------
    InputError
        Where the estimate has no times, or no relation finds its poses.
    """
    if estimate.t_s is None:
        raise InputError("evaluate: expected an estimate with times (TUM) for relations, found none")
    first, gap_first = _nearest(estimate.t_s, relations.first_s)
    second, gap_second = _nearest(estimate.t_s, relations.second_s)
    gap = np.maximum(gap_first, gap_second)
    used = np.flatnonzero(gap <= max_difference_s + ROUNDING_S)
    if used.size == 0:
        raise InputError(
            f"evaluate: expected poses within {max_difference_s:g} s of the relations' times, "
            f"found none nearer than {gap.min():.6g} s; are the clocks of both files the same?"
        )
    first, second = first[used], second[used]
    turned = estimate.rotations[first].transpose(0, 2, 1)
    shift = np.einsum("kab,kb->ka", turned, estimate.points_xyz_m[second] - estimate.points_xyz_m[first])
    turn = scipy.spatial.transform.Rotation.from_matrix(turned @ estimate.rotations[second])
    true_turn = scipy.spatial.transform.Rotation.from_euler(
        "ZYX", relations.roll_pitch_yaw_rad[used][:, ::-1]
    )
    difference = shift - relations.points_xyz_m[used]
    yaw = turn.as_euler("ZYX")[:, 0] - relations.roll_pitch_yaw_rad[used][:, 2]
    return RelationErrors(
        used,
        first,
        second,
        np.linalg.norm(difference, axis=1),
        np.asarray((true_turn.inv() * turn).magnitude()),
        np.column_stack([difference[:, :2], wrap_array_to_pi(yaw)]),
        len(relations),
    )


def relation_nees(errors: RelationErrors, covariance: FloatArray) -> FloatArray:
    """Normalized squared error (K,) of each relation; its expectation is 3 for a consistent estimate.

    Parameters
    ----------
    covariance
        (K, 3, 3) of the estimated motions, x, y, theta in the axes of the first pose (as
        ``PoseCovariances.relative`` has them for ``errors.first`` and ``errors.second``), with that of the
        hand-checked relations added where it is known.

    Raises
    ------
    InputError
        Where the shape does not fit or a covariance is singular.
    """
    if covariance.shape != (errors.used.size, 3, 3):
        raise InputError(
            f"evaluate: expected covariances of shape {(errors.used.size, 3, 3)}, found {covariance.shape}"
        )
    try:
        solved = np.linalg.solve(covariance, errors.planar[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        raise InputError("evaluate: expected covariances that are positive, found a singular one") from None
    return np.asarray(np.einsum("ka,ka->k", errors.planar, solved))


def _nearest(t_s: FloatArray, at_s: FloatArray) -> tuple[IntArray, FloatArray]:
    """Index of the nearest of increasing times, and how far it is."""
    right = np.searchsorted(t_s, at_s).clip(0, t_s.size - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(np.abs(t_s[left] - at_s) <= np.abs(t_s[right] - at_s), left, right)
    return nearest.astype(np.int64), np.abs(t_s[nearest] - at_s)
