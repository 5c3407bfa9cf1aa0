"""Calibrated odometry as a piece of a mission file, to be laid over any mission."""

from __future__ import annotations

from pilotage.calibration.intervals import Estimate
from pilotage.calibration.odometry import OdometryCalibration
from pilotage.sensors.wheel_odometry import WheelOdometryConfig


def parameter_yaml(found: OdometryCalibration, sensor: str = "odometry") -> str:
    """Return YAML that sets ``robot.sensors.<sensor>`` to what was found.

    What the logs do not tell keeps the sensor's default, and the file says so. Scales that cannot be told
    from 1 stay 1: a value inside its own noise would only put an error into the mission.
    """
    assumed = WheelOdometryConfig()
    lines = [
        "# Odometry as calibrated by 'pilotage calibrate odometry'. Use it with any mission:",
        "#   pilotage run MISSION --set @<this file>",
        "robot:",
        "  sensors:",
        f"    {sensor}:",
        "      name: wheel-odometry",
    ]
    densities = (
        "distance_var_m2_per_m",
        "distance_var_m2_per_rad",
        "angle_var_rad2_per_rad",
        "angle_var_rad2_per_m",
    )
    lines += [_line(name, getattr(found, name), getattr(assumed, name)) for name in densities]
    for name in ("distance_scale", "angle_scale"):
        estimate: Estimate | None = getattr(found, name)
        if estimate is not None and estimate.holds(1.0):
            lines.append(f"      {name}: 1.0  # {_interval(estimate)}: not told from 1")
        else:
            lines.append(_line(name, estimate, 1.0))
    return "\n".join(lines) + "\n"


def _line(name: str, estimate: Estimate | None, default: float) -> str:
    if estimate is None:
        return f"      {name}: {_number(default)}  # assumed: the logs do not tell"
    return f"      {name}: {_number(estimate.value)}  # {_interval(estimate)}"


def _interval(estimate: Estimate) -> str:
    return f"{estimate.value:.4g}, 95 %: {estimate.low:.4g} to {estimate.high:.4g}"


def _number(value: float) -> str:
    """YAML 1.1 reads a number with an exponent only if it has a point and a signed exponent."""
    text = f"{value:.6e}"
    return text if "e" in text else f"{value}"
