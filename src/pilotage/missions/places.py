"""Places of a mission: where robots begin, where they are to go, where they are carried."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.config import Config, MapConfig
from pilotage.sensors.sensor import NonNegative, Positive

Point = tuple[float, float]


class PoseConfig(MapConfig):
    """A start pose."""

    x_m: float
    y_m: float
    theta_rad: float = Field(default=0.0, ge=-2 * math.pi, le=2 * math.pi)


class GoalConfig(MapConfig):
    """A goal; without a heading any heading will do."""

    x_m: float
    y_m: float
    theta_rad: float | None = Field(default=None, ge=-2 * math.pi, le=2 * math.pi)
    tolerance_m: Positive = 0.3
    tolerance_rad: float = Field(default=math.pi, gt=0.0, le=math.pi)
    """Of the heading, where the goal has one; by default any heading is good enough."""


class RandomPlace(Config):
    """A pose drawn from the run's seed among those that a body can drive to from ``world.start``.

    It drives through passages that leave it 0.1 m on either side; the pose has ``clearance_m`` around it.
    Without a ``start`` among those of the floor that is meant: the largest that does not lie outside.
    """

    clearance_m: Positive = 0.6


class Kidnap(Config):
    """The robot is carried elsewhere and not told; without ``to``, to a random place."""

    at_s: NonNegative
    to: PoseConfig | None = None
    clearance_m: Positive = 0.6
    robot: int = Field(default=0, ge=0)
    """Which one of several."""
