"""A calibration of odometry as JSON knows it, every key with its unit."""

from __future__ import annotations

from pilotage.calibration.intervals import Estimate, Normality, lag_one_correlation
from pilotage.calibration.odometry import LogErrors, OdometryCalibration
from pilotage.core.types import FloatArray

ESTIMATES = (
    "distance_var_per_step_m2",
    "angle_var_per_step_rad2",
    "distance_var_m2_per_m",
    "distance_var_m2_per_rad",
    "angle_var_rad2_per_rad",
    "angle_var_rad2_per_m",
    "cross_cov_m_rad",
    "distance_scale",
    "angle_scale",
    "wheel_base_ratio",
    "curvature_rad_per_m",
    "heading_offset_rad",
    "distance_offset_m_per_step",
    "angle_offset_rad_per_step",
)


def odometry_summary(found: OdometryCalibration, wheel_base_m: float | None = None) -> dict[str, object]:
    """Return the JSON object: each estimate as ``value``, ``low``, ``high``; null where it is not told.

    Parameters
    ----------
    wheel_base_m
        The wheel base that the odometry was told, to give the true one in metres as well.
    """
    out: dict[str, object] = {name: _estimate(getattr(found, name)) for name in ESTIMATES}
    ratio = found.wheel_base_ratio
    if wheel_base_m is not None:
        out["wheel_base_m"] = None if ratio is None else ratio.scaled(wheel_base_m).as_dict()
    return out | {
        "step_m": found.step_m,
        "step_rad": found.step_rad,
        "offset": None if found.offset is None else found.offset.as_dict(),
        "logs": [_log(log) for log in found.logs],
        "warnings": list(found.warnings),
    }


def _estimate(estimate: Estimate | None) -> dict[str, float] | None:
    return None if estimate is None else estimate.as_dict()


def _log(log: LogErrors) -> dict[str, object]:
    return {
        "log": log.steps.name,
        "form": str(log.steps.form),
        "steps": len(log.steps),
        "used": log.used,
        "wrong_axis": log.astray,
        "offset_shape": None if log.offset is None else log.offset.best.shape,
        "distance_error": _errors(log.distance_m, log.distance_normality, "m"),
        "angle_error": _errors(log.angle_rad, log.angle_normality, "rad"),
    }


def _errors(values: FloatArray, test: Normality | None, unit: str) -> dict[str, object]:
    return {
        f"mean_{unit}": float(values.mean()),
        f"var_{unit}2": float(values.var(ddof=1)),
        "lag_one_correlation": lag_one_correlation(values),
        "normality_test": None if test is None else test.test,
        "normality_p": None if test is None else test.p_value,
    }
