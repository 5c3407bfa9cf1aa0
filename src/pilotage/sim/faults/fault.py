"""The role: what becomes of a sensor's readings on their way to the stack; and the registry of faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pilotage.core.checked import Gives
from pilotage.core.config import Config
from pilotage.core.misfit import misfit, told
from pilotage.core.registry import Registry
from pilotage.core.types import IntArray
from pilotage.sensors.readings import BeaconReadings, OdometryIncrement, Reading
from pilotage.sensors.sensor import NonNegative


class FaultConfig(Config):
    """Every fault's config derives from this one: whose readings it befalls, and from when on."""

    sensor: str
    """Its name under ``robot.sensors``."""
    from_s: NonNegative = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class FaultSetting:
    """What a fault is built in.

    Attributes
    ----------
    rng
        Its own generator.
    landmarks
        (L,) ids of the world's landmarks.
    where
        Its place in the mission, for messages.
    """

    rng: np.random.Generator
    landmarks: IntArray
    where: str


class Fault(Protocol):
    """One fault of one sensor, built as ``cls(config, setting)``."""

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:
        """What arrives in this step of what set out in it, none as a rule or one; called at every step."""


def _unfit(given: object, _: Fault, __: float, readings: Sequence[Reading]) -> str:
    if not isinstance(given, tuple | list):
        return told(given)
    kinds = tuple({type(reading) for reading in readings}) or tuple({type(reading) for reading in given})
    return next((wrong for reading in given if (wrong := misfit(reading, kinds))), "")


FAULTS: Registry[Fault] = Registry(
    "fault",
    "pilotage.sim.faults",
    gives=(Gives("pass_on", "a list or tuple of readings as they set out, of finite numbers", _unfit),),
)
"""Faults by name, as ``robot.faults`` lists them."""


def arrived(readings: Sequence[Reading]) -> Reading:
    """Readings of one sensor that arrive in one step, as one: increments add up, sightings are taken
    together, and of any other sensor the last one stays."""
    last = readings[-1]
    if len(readings) == 1:
        return last
    if isinstance(last, OdometryIncrement):
        parts = [one for one in readings if isinstance(one, OdometryIncrement)]
        return OdometryIncrement(
            sum(one.distance_m for one in parts),
            sum(one.angle_rad for one in parts),
            sum(one.lateral_m for one in parts),
        )
    if isinstance(last, BeaconReadings):
        seen = [one for one in readings if isinstance(one, BeaconReadings)]
        return BeaconReadings(
            np.concatenate([one.ids for one in seen]),
            np.concatenate([one.ranges_m for one in seen]),
            np.concatenate([one.bearings_rad for one in seen]),
        )
    return last


class Faults:
    """The faults of one robot, each with the sensor that it befalls, in the order in which they act."""

    def __init__(self, faults: Sequence[tuple[FaultConfig, Fault]]) -> None:
        self._by_sensor: dict[str, list[Callable[[float, Sequence[Reading]], Sequence[Reading]]]] = {}
        for config, fault in faults:
            self._by_sensor.setdefault(config.sensor, []).append(_begun(config.from_s, fault))

    def pass_on(self, t_s: float, said: Mapping[str, Reading]) -> dict[str, Reading]:
        """What of a step's readings arrives, and what was held back until now."""
        out = dict(said)
        for sensor, faults in self._by_sensor.items():
            readings: Sequence[Reading] = (out.pop(sensor),) if sensor in out else ()
            for pass_on in faults:
                readings = pass_on(t_s, readings)
            if readings:
                out[sensor] = arrived(readings)
        return out


def _begun(from_s: float, fault: Fault) -> Callable[[float, Sequence[Reading]], Sequence[Reading]]:
    def pass_on(t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:
        return fault.pass_on(t_s, readings) if t_s >= from_s else readings

    return pass_on
