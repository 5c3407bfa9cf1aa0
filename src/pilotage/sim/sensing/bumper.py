"""A bumper: which of its sectors a contact presses."""

from __future__ import annotations

import math

import numpy as np

from pilotage.sensors.bumper import BumperConfig
from pilotage.sensors.readings import BumperReading
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier


@SIMULATED_SENSORS.add(BumperConfig)
class SimulatedBumper:
    """Pressed where the body touched something in a step since the last reading."""

    def __init__(self, config: BumperConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        del rng
        self._body = carrier.body
        self._sectors = config.sectors
        self._first = config.mount.theta_rad - 0.5 * config.field_of_view_rad
        self._width = config.field_of_view_rad / config.sectors
        self._none = (False,) * config.sectors
        self._pressed = set[int]()

    def observe(self) -> None:
        """Feel where something touches."""
        if self._body.touching:
            aside = (self._body.contact_bearing_rad() - self._first) % (2.0 * math.pi)
            sector = int(aside / self._width)
            if sector < self._sectors:
                self._pressed.add(sector)

    def read(self) -> BumperReading:
        """Give what was pressed and start anew."""
        if not self._pressed:
            return BumperReading(self._none)
        pressed = tuple(sector in self._pressed for sector in range(self._sectors))
        self._pressed.clear()
        return BumperReading(pressed)
