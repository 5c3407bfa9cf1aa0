"""What every sensor's config has: a rate and a place on the body; and the registry of sensors."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from pilotage.core.config import SMALLEST, Config
from pilotage.core.errors import InputError
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2
from pilotage.sensors.numbers import FARTHEST_M, Numbers, SensorSetting

NonNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0)]
Reach = Annotated[float, Field(gt=0.0, le=FARTHEST_M)]
"""How far a sensor sees."""


class Mount(Config):
    """Pose of a sensor in the base frame: x forward, y left, counter-clockwise."""

    x_m: float = 0.0
    y_m: float = 0.0
    theta_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi)

    @classmethod
    def measured(cls, x_m: float, y_m: float = 0.0, theta_rad: float = 0.0) -> Mount:
        """As a recording tells it: 1e-300 m, which no file of settings may hold, is nothing."""
        x_m, y_m, theta_rad = (0.0 if abs(v) < SMALLEST else v for v in (x_m, y_m, theta_rad))
        return cls(x_m=x_m, y_m=y_m, theta_rad=theta_rad)

    @property
    def pose(self) -> Pose2:
        """As a pose."""
        return Pose2(self.x_m, self.y_m, self.theta_rad)

    def as_array(self) -> FloatArray:
        """(3,) x, y, theta, for the kernels."""
        return np.array([self.x_m, self.y_m, self.theta_rad])


class SensorConfig(Config):
    """Rate and mounting pose; every sensor's config derives from this one and adds its own fields."""

    rate_hz: Positive = 10.0
    mount: Mount = Mount()

    def every_steps(self, dt_s: float, where: str) -> int:
        """How many control steps lie between two readings; ``where`` names the sensor in a mission.

        Raises
        ------
        InputError
            If the rate is not a whole fraction of the step rate.
        """
        steps = 1.0 / (self.rate_hz * dt_s)
        whole = round(steps)
        if whole < 1 or abs(steps - whole) > 1e-6 * steps:
            raise InputError(
                f"{where}.rate_hz: expected a whole fraction of {1.0 / dt_s:g} Hz (run.dt_s = {dt_s:g} s), "
                f"found {self.rate_hz:g}; take {1.0 / (max(1, whole) * dt_s):g}, or run.dt_s: "
                f"{1.0 / (self.rate_hz * math.ceil(steps)):g}"
            )
        return whole

    def samples(self, dt_s: float) -> int:
        """How many samples a reading holds, of a sensor that is read several times in a step."""
        return max(1, round(self.rate_hz * dt_s))

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...] | None:
        """The numbers of every reading, in order; none of a sensor that tells none.

        None: whichever its first reading holds, without bounds.
        """
        del setting
        return None


SENSORS: Registry[SensorConfig] = Registry("sensor", "pilotage.sensors")
"""Sensor names to their configs; for a sensor the config is the whole description."""
