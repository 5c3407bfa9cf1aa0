"""What sensors say: one frozen value a reading, gathered by sensor name in ``Readings``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias

from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class OdometryIncrement:
    """Motion since the last odometry reading: distance along the arc and change of heading.

    A base that drives sideways has a distance to the left besides. Where it is known how uncertain this very
    turn is, as of one that wheels and gyroscope tell together, that counts instead of the data sheet. Of one
    that is a part of a longer increment ``part_var`` says how uncertain it is which part: variances ahead and
    to the left (m^2) and of the turn (rad^2), besides.
    """

    distance_m: float
    angle_rad: float
    lateral_m: float = 0.0
    angle_var_rad2: float | None = None
    part_var: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class LidarScan:
    """Ranges (N,) in beam order, counter-clockwise; ``max_range_m`` where nothing was hit."""

    ranges_m: FloatArray


@dataclass(frozen=True, slots=True)
class BeaconReadings:
    """Beacons seen at once: ids (K,), ranges (K,) and bearings (K,) in the sensor's frame."""

    ids: IntArray
    ranges_m: FloatArray
    bearings_rad: FloatArray


@dataclass(frozen=True, slots=True)
class UltrasonicReading:
    """Distance to the nearest return in the cone; ``saturated`` says that nothing was in reach."""

    range_m: float
    saturated: bool


@dataclass(frozen=True, slots=True)
class EncoderCounts:
    """Counts (N,) of each wheel in the N samples since the last step, oldest first."""

    left: IntArray
    right: IntArray


@dataclass(frozen=True, slots=True)
class GyroscopeRates:
    """Turn rates (N,) of the N samples since the last step, oldest first."""

    rates_rad_s: FloatArray


@dataclass(frozen=True, slots=True)
class MagneticField:
    """Horizontal field in the sensor's frame, x forward and y left."""

    x_ut: float
    y_ut: float


@dataclass(frozen=True, slots=True)
class InfraredReading:
    """Distance to the first return along the beam; ``saturated`` says that nothing was in reach."""

    range_m: float
    saturated: bool


@dataclass(frozen=True, slots=True)
class LineReading:
    """Whether the floor below is dark."""

    dark: bool


@dataclass(frozen=True, slots=True)
class YawRate:
    """Mean turn rate since the last reading."""

    rate_rad_s: float


@dataclass(frozen=True, slots=True)
class CompassHeading:
    """Heading of the body in the map, in [-pi, pi)."""

    heading_rad: float


@dataclass(frozen=True, slots=True)
class GpsFix:
    """Position of the antenna in the map."""

    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class BumperReading:
    """Whether each sector of the bumper is pressed, counter-clockwise."""

    pressed: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class RadioMessage:
    """What another robot sent: its name, when, and whatever it said."""

    sender: str
    sent_s: float
    content: object


@dataclass(frozen=True, slots=True)
class RadioMessages:
    """All messages that arrived since the last reading, oldest first."""

    messages: tuple[RadioMessage, ...]


Reading: TypeAlias = (
    OdometryIncrement
    | LidarScan
    | BeaconReadings
    | UltrasonicReading
    | EncoderCounts
    | GyroscopeRates
    | MagneticField
    | InfraredReading
    | LineReading
    | YawRate
    | CompassHeading
    | GpsFix
    | BumperReading
    | RadioMessages
)


def _empty() -> Mapping[str, Reading]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Readings:
    """What arrived in one step: time and the sensors that fired, by their name in the mission.

    All of a robot's parts are told the same ones, and the record after them: none can take one away.
    """

    t_s: float
    by_sensor: Mapping[str, Reading] = field(default_factory=_empty)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_sensor", MappingProxyType(self.by_sensor))
