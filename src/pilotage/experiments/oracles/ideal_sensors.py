"""The hardware without faults: what each sensor reads without noise, and a drive that does as it is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.bumper import BumperConfig
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

S = TypeVar("S", bound=SensorConfig)

FAULTS: Mapping[type[SensorConfig], Mapping[str, Any]] = {
    WheelOdometryConfig: {
        "distance_var_m2_per_m": 0.0,
        "distance_var_m2_per_rad": 0.0,
        "angle_var_rad2_per_rad": 0.0,
        "angle_var_rad2_per_m": 0.0,
        "distance_scale": 1.0,
        "angle_scale": 1.0,
        "angle_bias_rad_s": 0.0,
    },
    BeaconConfig: {"range_var_m2": 0.0, "bearing_var_rad2": 0.0, "bearing_offset_rad": 0.0},
    LidarConfig: {"range_var_m2": 0.0},
    RadioConfig: {"loss": 0.0, "delay_s": 0.0},
    UltrasonicConfig: {"range_var_m2": 0.0},
    WheelEncodersConfig: {},
    GyroscopeConfig: {
        "bias_rad_s": 0.0,
        "bias_walk_rad_s_sqrt_s": 0.0,
        "scale_error": 0.0,
        "rate_std_rad_s": 0.0,
    },
    InfraredConfig: {"range_std_fraction": 0.0},
    LineSensorConfig: {"edge_std_m": 0.0},
    MagnetometerConfig: {
        "hard_iron_ut": (0.0, 0.0),
        "soft_iron_ratio": 1.0,
        "field_std_ut": 0.0,
        "disturbance_ut": 0.0,
    },
    ImuConfig: {"bias_rad_s": 0.0, "bias_walk_rad_s_sqrt_s": 0.0, "rate_std_rad_s": 0.0},
    CompassConfig: {"heading_std_rad": 0.0, "declination_rad": 0.0, "disturbance_rad": 0.0},
    GpsConfig: {"position_std_m": 0.0, "bias_std_m": 0.0, "dropout_share": 0.0},
    BumperConfig: {},
}
"""By sensor, what it may do wrong and the value that means it does not: variances and standard deviations,
scales, biases and their drift, offsets, iron. Encoders count exactly; what a wheel does on the floor is no
fault of theirs."""
SILENT_PARTS = ("_var_", "_std_")


def ideal(config: S) -> S:
    """The same sensor without its faults; of one that is not known here, without its variances."""
    for kind, faults in FAULTS.items():
        if isinstance(config, kind):
            return config.model_copy(update=dict(faults))
    names = [name for name in type(config).model_fields if any(part in name for part in SILENT_PARTS)]
    return config.model_copy(update=dict.fromkeys(names, 0.0))


def ideal_sensors(sensors: Mapping[str, S]) -> dict[str, S]:
    """All sensors of a robot without their faults."""
    return {name: ideal(config) for name, config in sensors.items()}


def faithful(motion: MotionConfig) -> MotionConfig:
    """The same motion without errors and lag; random slip is still drawn and comes to nothing."""
    if not isinstance(motion, WheelDriveConfig):
        return motion
    exact = WheelErrorsConfig(
        radius_difference=0.0, separation_error=(0.0, 0.0), slip=(0.0, 0.0), slip_std_m_sqrt_m=0.0
    )
    return motion.model_copy(update={"motor_lag_s": 0.0, "errors": exact})
