"""Gyroscopes and magnetometers of several logs: those at rest tell biases, those that turned the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pilotage.calibration.gyro_reference import GyroReferenceCalibration, calibrate_against_reference
from pilotage.calibration.gyroscope import GyroscopeCalibration, calibrate_at_rest, is_moving, turns_of
from pilotage.calibration.intervals import Estimate
from pilotage.calibration.magnetometer import (
    BLOCKS,
    MagnetometerCalibration,
    calibrate_turned,
    noise_at_rest,
    turned,
)
from pilotage.core.errors import InputError
from pilotage.logs.heading_csv import HeadingLog, HeadingSensor
from pilotage.logs.reckoning_mat import ReckoningLog

AXES = "xyz"


@dataclass(frozen=True, slots=True)
class HeadingCalibration:
    """What the logs say of each sensor; ``axis`` is the one that the robot turns about."""

    axis: str
    gyroscope: tuple[GyroscopeCalibration, ...]
    magnetometer: tuple[MagnetometerCalibration, ...]
    resting_field: tuple[tuple[HeadingLog, tuple[Estimate, Estimate, Estimate]], ...]
    drives: tuple[GyroReferenceCalibration, ...] = ()

    @property
    def yaw_bias_rad_s(self) -> Estimate | None:
        """Bias of the yaw gyroscope at rest; without such a log, of the drive that tells it best."""
        at_rest = self.yaw_at_rest
        if at_rest is not None:
            return at_rest.bias_rad_s
        biases = [drive.bias_rad_s for drive in self.drives]
        return min(biases, key=lambda bias: bias.high - bias.low, default=None)

    @property
    def yaw_at_rest(self) -> GyroscopeCalibration | None:
        """The longest log at rest, its yaw axis."""
        found = [entry for entry in self.gyroscope if entry.axis == self.axis and not entry.moving]
        return max(found, key=lambda entry: entry.log.t_s[-1] - entry.log.t_s[0], default=None)

    def as_dict(self) -> dict[str, object]:
        """Return the result as JSON knows it, every key with its unit."""
        rest = self.yaw_at_rest
        walk = None if rest is None or rest.allan is None else rest.allan.angle_random_walk_rad_sqrt_s
        floor = None if rest is None or rest.allan is None else rest.allan.bias_instability_rad_s
        return {
            "axis": self.axis,
            "gyro_bias_rad_s": _dict(self.yaw_bias_rad_s),
            "gyro_angle_random_walk_rad_sqrt_s": _dict(walk),
            "gyro_angle_var_rad2_per_s": _dict(_squared(walk)),
            "gyro_bias_instability_rad_s": _dict(floor),
            "gyroscope": [_gyroscope(entry) for entry in self.gyroscope],
            "gyroscope_while_driving": [_drive(entry) for entry in self.drives],
            "magnetometer": [_magnetometer(entry) for entry in self.magnetometer],
            "magnetometer_at_rest": [
                {"log": log.name, "field_gauss": {a: e.as_dict() for a, e in zip(AXES, means, strict=True)}}
                for log, means in self.resting_field
            ],
        }


def calibrate_heading(
    logs: Sequence[HeadingLog], axis: str = "z", drives: Sequence[ReckoningLog] = ()
) -> HeadingCalibration:
    """Calibrate all logs; biases found at rest are taken off the turns.

    ``drives`` are of a robot with a reference heading; each may be of another gyroscope.

    Raises
    ------
    InputError
        Where there is no log, or the axis is none.
    """
    if axis not in AXES or len(axis) != 1:
        raise InputError(f"calibrate heading: expected an axis x, y or z, found '{axis}'")
    if not logs and not drives:
        raise InputError("calibrate heading: expected at least one log, found none")
    gyro = [log for log in logs if log.sensor is HeadingSensor.GYROSCOPE]
    compass = [log for log in logs if log.sensor is HeadingSensor.MAGNETOMETER]
    for log in compass:
        if log.t_s.shape[0] < BLOCKS:
            raise InputError(f"{log.place}: expected {BLOCKS} or more readings, found {log.t_s.shape[0]}")
    moving = {id(log): is_moving(log) for log in gyro}
    at_rest = [calibrate_at_rest(log, i) for log in gyro if not moving[id(log)] for i in range(3)]
    yaw = AXES.index(axis)
    biases = [entry.bias_rad_s.value for entry in at_rest if entry.axis == axis and entry.bias_rad_s]
    bias = biases[0] if biases else 0.0
    turning = [turns_of(log, yaw, bias) for log in gyro if moving[id(log)]]
    return HeadingCalibration(
        axis,
        (*at_rest, *turning),
        tuple(calibrate_turned(log) for log in compass if turned(log)),
        tuple((log, noise_at_rest(log)) for log in compass if not turned(log)),
        tuple(calibrate_against_reference(drive) for drive in drives),
    )


def _dict(estimate: Estimate | None) -> dict[str, float] | None:
    return None if estimate is None else estimate.as_dict()


def _squared(estimate: Estimate | None) -> Estimate | None:
    if estimate is None:
        return None
    return Estimate(estimate.value**2, estimate.low**2, estimate.high**2)


def _gyroscope(entry: GyroscopeCalibration) -> dict[str, object]:
    out: dict[str, object] = {
        "log": entry.log.name,
        "axis": entry.axis,
        "readings": int(entry.log.t_s.shape[0]),
        "duration_s": float(entry.log.t_s[-1] - entry.log.t_s[0]),
        "moving": entry.moving,
    }
    if entry.allan is not None:
        return out | {
            "bias_rad_s": _dict(entry.bias_rad_s),
            "angle_random_walk_rad_sqrt_s": _dict(entry.allan.angle_random_walk_rad_sqrt_s),
            "bias_instability_rad_s": _dict(entry.allan.bias_instability_rad_s),
            "allan_tau_s": entry.allan.tau_s.tolist(),
            "allan_deviation_rad_s": entry.allan.deviation_rad_s.tolist(),
        }
    return out | {"turn_rad": entry.turn_rad, "scale_if_whole_turns": entry.scale}


def _drive(entry: GyroReferenceCalibration) -> dict[str, object]:
    return {
        "log": entry.log.name,
        "steps": int(entry.log.t_s.shape[0]),
        "duration_s": float(entry.log.dt_s.sum()),
        "reference_gaps_s": entry.gaps_s,
        "bias_rad_s": entry.bias_rad_s.as_dict(),
        "bias_with_scale_rad_s": _dict(entry.bias_with_scale_rad_s),
        "scale": _dict(entry.scale),
    }


def _magnetometer(entry: MagnetometerCalibration) -> dict[str, object]:
    return {
        "log": entry.log.name,
        "axes": entry.axes,
        "offset_gauss": {a: e.as_dict() for a, e in zip(entry.axes, entry.offset_gauss, strict=True)},
        "axis_ratio": entry.axis_ratio.as_dict(),
        "radius_gauss": entry.radius_gauss,
        "residual_gauss": entry.residual_gauss,
        "soft_iron": entry.soft_iron.tolist(),
        "tilt_rad": entry.tilt_rad,
    }
