"""Missions on a sheet: a small robot explores and maps boxes and tape, with nothing at the sheet's edge."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from pilotage.core.config import Config
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.mission import ComponentChoice, Mission, PoseConfig
from pilotage.sensors.sensor import NonNegative, Positive

Share = Annotated[float, Field(ge=0.0, lt=0.5)]


SheetSource = Annotated[
    Annotated[str, Tag("name")] | Annotated[SheetFile, Tag("inline")],
    # Told apart beforehand, so that an error speaks of what was meant.
    Discriminator(lambda value: "name" if isinstance(value, str) else "inline"),
]


class SheetWorldConfig(Config):
    """The sheet (a shipped name, a file, or the sheet itself) and where the robot is put down.

    Without ``start`` it begins where the sheet says, or in the middle.
    """

    kind: Literal["sheet"]
    sheet: SheetSource
    start: PoseConfig | None = None
    tape_width_m: Positive = 0.015
    floor_is_dark: bool = True
    """Whether line sensors read dark beyond the sheet's edge, as on the film's grey carpet."""


class SheetBodyConfig(Config):
    """A disc."""

    radius_m: Positive = 0.0815


class WheelDriveConfig(Config):
    """Differential drive by wheel speeds: the data sheet, which the robot knows."""

    name: Literal["wheel-drive"] = "wheel-drive"
    wheel_radius_m: Positive = 0.035
    wheel_separation_m: Positive = 0.1421
    max_wheel_speed_rad_s: Positive = 3.0
    motor_lag_s: Positive = 0.05
    """Time constant of a wheel's speed behind its command."""


class DriveErrorsConfig(Config):
    """How this robot differs from its data sheet, which it does not know.

    Of each range a size is drawn from the run's seed; which wheel is the larger one, and whether the
    separation is more or less than said, is drawn too.
    """

    radius_difference: Share = 0.005
    """Larger over smaller wheel, minus one."""
    separation_error: tuple[Share, Share] = (0.01, 0.02)
    slip: tuple[Share, Share] = (0.01, 0.02)
    """Each wheel rolls this much less far than it turns."""
    slip_std_m_sqrt_m: NonNegative = 0.0015
    """Random slip of each wheel: standard deviation over one metre."""

    @model_validator(mode="after")
    def _ordered(self) -> DriveErrorsConfig:
        for name in ("separation_error", "slip"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: expected the smaller bound first, found {low:g} and {high:g}")
        return self


class SheetRobotConfig(Config):
    """Body, drive, its errors, and sensors (each a registered ``name`` with its parameters)."""

    body: SheetBodyConfig = SheetBodyConfig()
    motion: WheelDriveConfig = WheelDriveConfig()
    errors: DriveErrorsConfig = DriveErrorsConfig()
    sensors: dict[str, ComponentChoice]


class FirmwareConfig(Config):
    """The faults of the real robot's firmware, off by default; for the study of its mapping error."""

    truncated_wheel_speed: bool = False
    """Wheel speeds enter the position as whole numbers of rad/s."""
    pose_period_s: NonNegative = 0.0
    """The pose is brought up to date this often, by the wheel speeds of that moment; 0: at every step."""
    lines_at_centre: bool = False
    """A tape is marked where the robot's centre is, 70 mm behind the sensor that saw it."""


class SheetStackConfig(Config):
    """The explorer and its two switches; firmware faults."""

    explorer: ComponentChoice
    fusion: bool = True
    """Whether the heading comes from encoders and gyroscope fused, or from encoders alone."""
    magnetometer: bool = False
    """Whether a magnetometer then corrects the heading; the report's robot could, its experiments did not."""
    avoidance: bool = True
    """Whether something reacts to obstacles that the explorer did not plan for."""
    firmware: FirmwareConfig = FirmwareConfig()


class SheetMission(Mission):
    """A mission on a sheet."""

    world: SheetWorldConfig
    robot: SheetRobotConfig
    stack: SheetStackConfig
