"""Readings that arrive in time and are wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi, wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.sensors.readings import (
    BeaconReadings,
    CompassHeading,
    GpsFix,
    InfraredReading,
    LidarScan,
    OdometryIncrement,
    Reading,
    UltrasonicReading,
    YawRate,
)
from pilotage.sensors.sensor import NonNegative
from pilotage.sim.faults.fault import FAULTS, FaultConfig, FaultSetting


class SwapIdentitiesConfig(FaultConfig):
    """Which share of the sightings is taken for another landmark."""

    share: float = Field(default=0.05, ge=0.0, le=1.0)


@FAULTS.add("swap-identities", SwapIdentitiesConfig)
class SwapIdentities:
    """Takes sightings, each by itself, for another landmark of the map; range and bearing stay."""

    def __init__(self, config: SwapIdentitiesConfig, setting: FaultSetting) -> None:
        if len(setting.landmarks) < 2:
            raise InputError(f"{setting.where}: expected two or more landmarks in the world, found fewer")
        self._share, self._rng, self._ids = config.share, setting.rng, setting.landmarks

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """Sightings under the names that they are taken for; other readings as they are."""
        return [self._swapped(one) if isinstance(one, BeaconReadings) else one for one in readings]

    def _swapped(self, seen: BeaconReadings) -> BeaconReadings:
        ids = seen.ids.copy()
        for k in np.flatnonzero(self._rng.random(len(ids)) < self._share):
            ids[k] = self._rng.choice(self._ids[self._ids != ids[k]])
        return replace(seen, ids=ids)


class OutliersConfig(FaultConfig):
    """Which share of the numbers is spoilt, and by how much at most."""

    share: float = Field(default=0.05, ge=0.0, le=1.0)
    most_m: NonNegative = 5.0
    most_rad: NonNegative = 1.0


@FAULTS.add("outliers", OutliersConfig)
class Outliers:
    """Adds to some readings an error that is uniform within its bounds; of many beams or sightings in one
    reading each is spoilt by itself."""

    def __init__(self, config: OutliersConfig, setting: FaultSetting) -> None:
        self._config, self._rng = config, setting.rng

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """All of them, some spoilt."""
        config = self._config
        out = []
        for reading in readings:
            size = _size(reading)
            spoilt = self._rng.random(size) < config.share
            errors = self._rng.uniform(-1.0, 1.0, (2, size)) * spoilt
            out.append(_off_by(reading, config.most_m * errors[0], config.most_rad * errors[1]))
        return out


class BiasStepConfig(FaultConfig):
    """What is added to every length and angle from ``from_s`` on."""

    by_m: float = 0.0
    by_rad: float = 0.0


@FAULTS.add("bias-step", BiasStepConfig)
class BiasStep:
    """Adds the same error to every reading; to odometry at every increment."""

    def __init__(self, config: BiasStepConfig, setting: FaultSetting) -> None:
        del setting
        self._config = config

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """All of them, each off by the same."""
        config = self._config
        out = []
        for one in readings:
            ones = np.ones(_size(one))
            out.append(_off_by(one, config.by_m * ones, config.by_rad * ones))
        return out


def _size(reading: Reading) -> int:
    """How many beams or sightings are in a reading."""
    return len(reading.ranges_m) if isinstance(reading, LidarScan | BeaconReadings) else 1


def _off_by(reading: Reading, metres: FloatArray, radians: FloatArray) -> Reading:
    """A reading with errors (size,) added to its lengths and angles; ranges stay above zero.

    One without length or angle (counts, a bumper) stays as it is.
    """
    first_m, first_rad = float(metres[0]) if len(metres) else 0.0, float(radians[0]) if len(radians) else 0.0
    match reading:
        case LidarScan():
            return LidarScan(np.maximum(reading.ranges_m + metres, 0.0))
        case BeaconReadings():
            ranges = np.maximum(reading.ranges_m + metres, 0.0)
            return BeaconReadings(reading.ids, ranges, wrap_array_to_pi(reading.bearings_rad + radians))
        case OdometryIncrement():
            return replace(
                reading, distance_m=reading.distance_m + first_m, angle_rad=reading.angle_rad + first_rad
            )
        case UltrasonicReading() | InfraredReading():
            return replace(reading, range_m=max(reading.range_m + first_m, 0.0))
        case CompassHeading():
            return CompassHeading(wrap_to_pi(reading.heading_rad + first_rad))
        case YawRate():
            return YawRate(reading.rate_rad_s + first_rad)
        case GpsFix():
            return GpsFix(reading.x_m + first_m, reading.y_m)
        case _:
            return reading
