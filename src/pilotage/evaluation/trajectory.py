"""How far an estimated trajectory is from its reference: absolute and relative errors.

The absolute error (ATE) is the distance between associated positions, after an alignment where one is
asked for. The relative error (RPE) compares each step from one associated pose to the next:
``(Q_i^-1 Q_{i+1})^-1 (P_i^-1 P_{i+1})`` with the reference ``Q`` and the estimate ``P``, of which the
translation's length counts. Both as defined by Sturm et al., "A benchmark for the evaluation of RGB-D
SLAM systems", IROS 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.evaluation.pose_errors import rms
from pilotage.logs.trajectories import Trajectory3

MAX_TIME_DIFFERENCE_S = 0.01
"""Poses farther apart in time than this are not the same moment."""


@dataclass(frozen=True, slots=True)
class Similarity:
    """The map ``y = scale * rotation @ x + translation_m``."""

    rotation: FloatArray
    translation_m: FloatArray
    scale: float


@dataclass(frozen=True, slots=True)
class TrajectoryErrors:
    """Errors of an estimate: ``ate_m`` (N,) of its poses, ``rpe_m`` (N - 1,) of its steps."""

    ate_m: FloatArray
    rpe_m: FloatArray
    alignment: Similarity

    def summary(self) -> dict[str, float | int]:
        """Root mean square, mean, median and maximum of both errors, under their JSON keys."""
        out: dict[str, float | int] = {}
        for name, values in (("ate", self.ate_m), ("rpe", self.rpe_m)):
            out[f"{name}_rmse_m"] = rms(values)
            out[f"{name}_mean_m"] = float(values.mean())
            out[f"{name}_median_m"] = float(np.median(values))
            out[f"{name}_max_m"] = float(values.max())
        return out | {"poses": self.ate_m.shape[0], "scale": self.alignment.scale}


def trajectory_errors(
    estimate: Trajectory3, reference: Trajectory3, *, align: bool = False, scale: bool = False
) -> TrajectoryErrors:
    """Compare an estimate with its reference.

    Poses are associated by time (``associate``), or one by one where neither trajectory has times.

    Parameters
    ----------
    align
        Rotate and shift the estimate onto the reference first (least squares over all positions).
    scale
        Correct the estimate's scale as well; alone it corrects nothing but the scale.

    Raises
    ------
    InputError
        Where fewer than two poses are common, lengths differ without times, or the positions lie on a
        line or in a point, so that no alignment is defined.
    """
    if estimate.t_s is None or reference.t_s is None:
        if len(estimate) != len(reference):
            raise InputError(
                f"evaluate: without times expected as many poses in both files, "
                f"found {len(estimate)} and {len(reference)}"
            )
        picks = np.arange(len(estimate)), np.arange(len(reference))
    else:
        picks = associate(estimate.t_s, reference.t_s)
    if picks[0].size < 2:
        raise InputError(
            f"evaluate: expected at least two poses within {MAX_TIME_DIFFERENCE_S:g} s of each other, "
            f"found {picks[0].size}; are the clocks of both files the same?"
        )
    points, rotations = estimate.points_xyz_m[picks[0]], estimate.rotations[picks[0]]
    true_points, true_rotations = reference.points_xyz_m[picks[1]], reference.rotations[picks[1]]
    found = Similarity(np.eye(3), np.zeros(3), 1.0)
    if align or scale:
        fitted = umeyama(points, true_points, with_scale=scale)
        found = fitted if align else Similarity(np.eye(3), np.zeros(3), fitted.scale)
    points = found.scale * points @ found.rotation.T + found.translation_m
    rotations = found.rotation @ rotations
    ate = np.linalg.norm(points - true_points, axis=1)
    return TrajectoryErrors(ate, _relative(points, rotations, true_points, true_rotations), found)


def associate(
    first_s: FloatArray, second_s: FloatArray, max_difference_s: float = MAX_TIME_DIFFERENCE_S
) -> tuple[IntArray, IntArray]:
    """Pair each time of the shorter series with the nearest one of the longer.

    Of two equally near times the earlier counts; a time of the longer series may serve twice. Series of
    equal length: the times of the first are looked up in the second.

    Returns
    -------
    Indices (K,) into the first and (K,) into the second series.
    """
    swap = first_s.shape[0] > second_s.shape[0]
    few, many = (second_s, first_s) if swap else (first_s, second_s)
    right = np.searchsorted(many, few).clip(1, max(many.shape[0] - 1, 1))
    left = right - 1
    right = np.minimum(right, many.shape[0] - 1)
    nearest = np.where(np.abs(many[left] - few) <= np.abs(many[right] - few), left, right)
    kept = np.flatnonzero(np.abs(many[nearest] - few) <= max_difference_s)
    pair = kept.astype(np.int64), nearest[kept].astype(np.int64)
    return (pair[1], pair[0]) if swap else pair


def umeyama(points: FloatArray, targets: FloatArray, *, with_scale: bool) -> Similarity:
    """Least-squares similarity that maps ``points`` (N, 3) onto ``targets`` (N, 3).

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI
    1991, eq. 40-43.

    Raises
    ------
    InputError
        Where the points span less than a plane: the rotation is then not determined.
    """
    centre, target_centre = points.mean(axis=0), targets.mean(axis=0)
    shifted, target_shifted = points - centre, targets - target_centre
    U, d, Vt = np.linalg.svd(target_shifted.T @ shifted / points.shape[0])
    if d[1] <= np.finfo(float).eps * max(d[0], 1e-300) * 10.0:
        raise InputError(
            "evaluate: expected positions that span a plane at least, found them on a line or in a point; "
            "leave out --align and --scale"
        )
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))])
    rotation = (U * sign) @ Vt
    variance = float((shifted**2).sum() / points.shape[0])
    scale = float(d @ sign) / variance if with_scale else 1.0
    return Similarity(rotation, target_centre - scale * rotation @ centre, scale)


def _relative(
    points: FloatArray, rotations: FloatArray, true_points: FloatArray, true_rotations: FloatArray
) -> FloatArray:
    """Length (N - 1,) of the translational error of each step.

    A pose is inverted by its transpose, so rotations that are rounded stay as they are.
    """
    step = _steps_in_body(points, rotations)
    true_step = _steps_in_body(true_points, true_rotations)
    true_turn = true_rotations[:-1].transpose(0, 2, 1) @ true_rotations[1:]
    # The error's translation stands in the frame of the reference's next pose; its length does not
    # change for exact rotations, but rounded ones (KITTI prints seven digits) show at 1e-9.
    error = np.einsum("nji,nj->ni", true_turn, step - true_step)
    return np.asarray(np.linalg.norm(error, axis=1))


def _steps_in_body(points: FloatArray, rotations: FloatArray) -> FloatArray:
    """Steps (N - 1, 3) from pose to pose, seen from the earlier pose."""
    return np.asarray(np.einsum("nji,nj->ni", rotations[:-1], np.diff(points, axis=0)))
