"""The role of a simulated sensor, and the registry by which each config finds its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from pilotage.core.checked import Gives
from pilotage.core.misfit import misfit
from pilotage.sensors.readings import Reading
from pilotage.sim.bodies.body import Body
from pilotage.sim.by_config import ByConfig
from pilotage.sim.worlds.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """What a sensor is on.

    Attributes
    ----------
    where
        Its place in the mission, for messages.
    dt_s, every
        Length of a step, and how many steps lie between two readings.
    """

    world: World
    body: Body
    where: str
    dt_s: float
    every: int

    @property
    def period_s(self) -> float:
        """Time between two readings."""
        return self.every * self.dt_s


class SimulatedSensor(Protocol):
    """One sensor on one robot, built with its config, its carrier, and its noise stream.

    It refuses a world that cannot serve it when it is built. A sensor that sums over time has a method
    ``observe()`` besides, called after every step and before ``read``. One that is read in samples, several
    in a step, sets ``sampled = True``.
    """

    def read(self) -> Reading | None:
        """Give a reading, called when the sensor's period is over; None where it fails to arrive."""


class ReadTogether(Protocol):
    """A sensor that is cheaper to read for many at once: instead of ``read`` it has these."""

    @staticmethod
    def alike(config: Any) -> object:
        """What sensors must have in common, beside their rate, to be read together."""

    @classmethod
    def together(cls, sensors: Sequence[Any]) -> Callable[[], Sequence[Reading | None]]:
        """A function that reads sensors of this class, in their order."""


def _unfit(given: object, *_: object) -> str:
    """Readings of a type of their own are welcome, if they are numbers.

    No inf: records and pages hold none, and who averages ranges goes through a run unseen.
    """
    return "" if given is None else misfit(given, type(given))


SIMULATED_SENSORS: ByConfig[SimulatedSensor | ReadTogether] = ByConfig(
    "sensor",
    "pilotage.sim.sensing",
    Gives("read", "a reading of finite numbers (the reach where nothing is hit), or None", _unfit),
)
"""Sensor configs to what they would read."""
