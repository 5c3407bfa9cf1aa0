"""Calibration of odometry from logs that hold the truth: noise densities and systematic errors.

The claimed distance and turn of a step, compared with the true ones:

    claimed distance = distance_scale * d                       + noise of variance q_dd |d| + q_da |a|
    claimed turn     = angle_scale * a + curvature * d          + noise of variance q_aa |a| + q_ad |d|

Offsets that do not grow with the motion (per step) are estimated where steps of different length allow it.
A differential drive turns its wheels' difference over the wheel base, so the true wheel base is
``angle_scale`` times the one that the odometry was told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.calibration.error_model import ErrorModel, fit_error
from pilotage.calibration.intervals import (
    Estimate,
    Normality,
    lag_one_correlation,
    mean_estimate,
    normal_estimate,
    normality,
    variance_estimate,
)
from pilotage.calibration.offset_shape import OffsetComparison, compare_offsets
from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.logs.odometry_steps import OdometryForm, OdometrySteps, arc_lengths

NO_NOISE = 1e-9
"""Errors that scatter less than this (m, rad) are rounding: the log says nothing about that noise."""
MOVES_M, TURNS_RAD = 1e-6, 1e-6
ASTRAY_RAD = 0.02
"""A log whose heading is farther from the wrong axis than this has errors that are no odometry errors."""


@dataclass(frozen=True, slots=True)
class LogErrors:
    """One log's errors.

    Attributes
    ----------
    steps
        The log.
    distance_m, angle_rad
        (N,) errors of the claimed distance (along the wrong axis where the offset has that shape) and turn.
    offset
        Which shape this log's own offset has; None where it stands still.
    astray
        Whether its steps are claimed along a wrong axis.
    used
        Whether the noise parameters rest on it.
    distance_normality, angle_normality
        None where there is no noise to test.
    """

    steps: OdometrySteps
    distance_m: FloatArray
    angle_rad: FloatArray
    offset: OffsetComparison | None
    astray: bool
    used: bool
    distance_normality: Normality | None
    angle_normality: Normality | None


@dataclass(frozen=True, slots=True)
class OdometryCalibration:
    """What the logs say; None for what they do not tell. Every name carries its unit."""

    logs: tuple[LogErrors, ...]
    offset: OffsetComparison | None
    distance_var_per_step_m2: Estimate | None
    angle_var_per_step_rad2: Estimate | None
    distance_var_m2_per_m: Estimate | None
    distance_var_m2_per_rad: Estimate | None
    angle_var_rad2_per_rad: Estimate | None
    angle_var_rad2_per_m: Estimate | None
    distance_scale: Estimate | None
    angle_scale: Estimate | None
    curvature_rad_per_m: Estimate | None
    distance_offset_m_per_step: Estimate | None
    angle_offset_rad_per_step: Estimate | None
    heading_offset_rad: Estimate | None
    cross_cov_m_rad: Estimate | None
    step_m: float
    step_rad: float
    warnings: tuple[str, ...]

    @property
    def wheel_base_ratio(self) -> Estimate | None:
        """True wheel base over the one that the odometry was told."""
        return self.angle_scale


def calibrate_odometry(logs: Sequence[OdometrySteps]) -> OdometryCalibration:
    """Estimate noise and systematic errors from all logs together.

    Logs whose offset is a step along a wrong axis are named and left out of the parameters, unless there
    is nothing else to learn the distance noise from.

    Raises
    ------
    InputError
        Where no log moves.
    """
    if not logs:
        raise InputError("calibrate odometry: expected at least one log, found none")
    offset = compare_offsets(logs)
    axis = None if offset is None else offset.axis_rad
    astray = [axis is not None and _strays(log, axis) for log in logs]
    warnings = []
    if any(astray):
        names = ", ".join(log.name for log, off in zip(logs, astray, strict=True) if off)
        assert offset is not None
        warnings.append(f"{names}: the offset is that of a step along a wrong axis, not of a bias")
    usable = [not off for off in astray]
    told = any(use and bool(_moves(log).any()) for use, log in zip(usable, logs, strict=True))
    if any(astray) and not told:
        usable = [True] * len(logs)
        warnings.append("the distance noise is taken along the wrong axis: no other log moves")
    errors = tuple(
        _log_errors(log, axis if off else None, use)
        for log, off, use in zip(logs, astray, usable, strict=True)
    )
    used = [log for log in errors if log.used]
    distance, angle = _distance_model(used), _angle_model(used)
    if distance is None and angle is None:
        moved = any(bool(_moves(log).any()) for log in logs)
        problem = "a robot that moves, found it standing still"
        exact = "odometry whose errors vary, found all alike: is the truth the odometry itself?"
        raise InputError(f"calibrate odometry: expected logs of {exact if moved else problem}")
    warnings += _noise_warnings(errors)
    if not any(log.distance_m.std() > NO_NOISE and log.angle_rad.std() > NO_NOISE for log in used):
        warnings.append("no log shows distance and angle errors at once: their covariance is zero in each")
    warnings += _offset_warnings(distance, angle)
    moving = np.concatenate([np.abs(log.steps.arc_m[_moves(log.steps)]) for log in used])
    turning = np.concatenate([np.abs(log.steps.turn_rad[_turns(log.steps)]) for log in used])
    return OdometryCalibration(
        logs=errors,
        offset=offset,
        distance_var_per_step_m2=_per_step(distance, used, _moves, "distance_m"),
        angle_var_per_step_rad2=_per_step(angle, used, _turns, "angle_rad"),
        distance_var_m2_per_m=None if distance is None else distance.density[0],
        distance_var_m2_per_rad=None if distance is None else distance.density[1],
        angle_var_rad2_per_rad=None if angle is None else angle.density[0],
        angle_var_rad2_per_m=None if angle is None else angle.density[1],
        distance_scale=_plus_one(None if distance is None else distance.mean[0]),
        angle_scale=_plus_one(None if angle is None else angle.mean[0]),
        curvature_rad_per_m=None if angle is None else angle.mean[1],
        distance_offset_m_per_step=None if distance is None else distance.mean[1],
        angle_offset_rad_per_step=None if angle is None else angle.mean[2],
        heading_offset_rad=_heading_offset([log for log in used if not log.astray]),
        cross_cov_m_rad=_cross_cov(used),
        step_m=float(moving.mean()) if moving.size else 0.0,
        step_rad=float(turning.mean()) if turning.size else 0.0,
        warnings=tuple(warnings),
    )


def _moves(log: OdometrySteps) -> BoolArray:
    return np.abs(log.arc_m) > MOVES_M


def _turns(log: OdometrySteps) -> BoolArray:
    return np.abs(log.turn_rad) > TURNS_RAD


def _strays(log: OdometrySteps, axis_rad: float) -> bool:
    """Whether the log drives along another direction than the wrong axis."""
    moves = _moves(log)
    if not moves.any():
        return False
    return float(np.abs(wrap_array_to_pi(log.middle_heading_rad[moves] - axis_rad)).mean()) > ASTRAY_RAD


def _log_errors(log: OdometrySteps, axis_rad: float | None, used: bool) -> LogErrors:
    if axis_rad is None:
        claimed = arc_lengths(log.start, log.claimed)
    else:
        step = log.claimed[:, :2] - log.start[:, :2]
        claimed = step @ np.array([np.cos(axis_rad), np.sin(axis_rad)])
    distance = np.asarray(claimed - log.arc_m)
    angle = wrap_array_to_pi(log.claimed_turn_rad - log.turn_rad)
    return LogErrors(
        log,
        distance,
        angle,
        compare_offsets([log]),
        axis_rad is not None,
        used,
        normality(distance) if distance.std() > NO_NOISE else None,
        normality(angle) if angle.std() > NO_NOISE else None,
    )


def _distance_model(used: Sequence[LogErrors]) -> ErrorModel | None:
    seen = [log for log in used if log.distance_m.std() > NO_NOISE]
    if not seen:
        return None
    arc = np.concatenate([log.steps.arc_m for log in seen])
    turn = np.concatenate([log.steps.turn_rad for log in seen])
    X = np.column_stack([arc, np.ones_like(arc)])
    return fit_error(_all(seen, "distance_m"), X, _motion(arc, turn))


def _angle_model(used: Sequence[LogErrors]) -> ErrorModel | None:
    seen = [log for log in used if log.angle_rad.std() > NO_NOISE]
    if not seen:
        return None
    arc = np.concatenate([log.steps.arc_m for log in seen])
    turn = np.concatenate([log.steps.turn_rad for log in seen])
    X = np.column_stack([turn, arc, np.ones_like(arc)])
    return fit_error(_all(seen, "angle_rad"), X, _motion(turn, arc))


def _motion(first: FloatArray, second: FloatArray) -> FloatArray:
    """Absolute motions (N, 2) that the variance grows with; rounding is no motion."""
    columns = np.abs(np.column_stack([first, second]))
    return np.where(columns > min(MOVES_M, TURNS_RAD), columns, 0.0)


def _all(logs: Sequence[LogErrors], name: str) -> FloatArray:
    return np.concatenate([np.asarray(getattr(log, name)) for log in logs])


def _per_step(
    model: ErrorModel | None,
    used: Sequence[LogErrors],
    counted: Callable[[OdometrySteps], BoolArray],
    name: str,
) -> Estimate | None:
    """Variance of the steps that are counted, about the fitted mean."""
    if model is None:
        return None
    which = np.concatenate([counted(log.steps) for log in used if getattr(log, name).std() > NO_NOISE])
    count = int(which.sum())
    dof = count - (which.shape[0] - model.dof)
    if dof < 2:
        return None
    return variance_estimate(float((model.residual[which] ** 2).sum()) / dof, dof)


def _plus_one(estimate: Estimate | None) -> Estimate | None:
    if estimate is None:
        return None
    return Estimate(1.0 + estimate.value, 1.0 + estimate.low, 1.0 + estimate.high)


def _heading_offset(used: Sequence[LogErrors]) -> Estimate | None:
    """Mean angle from the true direction of motion to the claimed one; None where it is not recorded."""
    angles = []
    for log in used:
        if log.steps.form is OdometryForm.INCREMENTS:
            continue  # distance and turn say nothing of the direction
        steps, moves = log.steps, _moves(log.steps)
        step, middle = steps.claimed[:, :2] - steps.start[:, :2], steps.middle_heading_rad
        left = -step[:, 0] * np.sin(middle) + step[:, 1] * np.cos(middle)
        left = left - 0.5 * steps.arc_m * log.angle_rad  # an arc's chord turns by half of the turn's error
        angles.append(left[moves] / steps.arc_m[moves])
    values = np.concatenate([np.zeros(0), *angles])
    return mean_estimate(values) if values.size > 2 and values.std() > 1e-7 else None


def _cross_cov(used: Sequence[LogErrors]) -> Estimate | None:
    """Covariance of distance and angle errors of the same step, about each log's means.

    The product of the two has variance s_d^2 s_a^2 + c^2 for normal errors.
    """
    products, dof, variance = 0.0, 0, 0.0
    for log in used:
        d, a = log.distance_m - log.distance_m.mean(), log.angle_rad - log.angle_rad.mean()
        products += float(d @ a)
        dof += d.shape[0] - 1
        variance += float(d @ d) * float(a @ a) / max(d.shape[0] - 1, 1)
    if dof < 2:
        return None
    value = products / dof
    return normal_estimate(value, float(np.sqrt(variance + dof * value**2)) / dof, dof)


def _offset_warnings(distance: ErrorModel | None, angle: ErrorModel | None) -> list[str]:
    """Say where steps of one size hide an offset: its column is a combination of the motions then."""
    hidden = [
        name
        for name, model, where in (("distance", distance, 1), ("angle", angle, 2))
        if model is not None and model.mean[0] is not None and model.mean[where] is None
    ]
    if not hidden:
        return []
    return [
        f"{' and '.join(hidden)}: all steps are of one size, so an offset per step would pass for a scale; "
        "logs at several speeds tell them apart"
    ]


def _noise_warnings(errors: Sequence[LogErrors]) -> list[str]:
    """Say where the errors are not what the intervals suppose: normal and independent."""
    out = []
    for log in errors:
        for name, values, test in (
            ("distance", log.distance_m, log.distance_normality),
            ("angle", log.angle_rad, log.angle_normality),
        ):
            if test is None:
                continue
            if test.p_value < 0.001:
                out.append(f"{log.steps.name}: the {name} errors are not normal (p = {test.p_value:.2g})")
            rho = lag_one_correlation(values)
            if abs(rho) > 4.0 / np.sqrt(values.shape[0]):
                out.append(
                    f"{log.steps.name}: neighbouring {name} errors are correlated ({rho:.2f}); "
                    "the intervals are too narrow"
                )
    return out
