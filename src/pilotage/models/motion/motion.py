"""The role: a motion's data sheet, which the robot knows; and the registry of motions."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from pilotage.core.config import Config
from pilotage.core.misfit import LARGEST, unfit_number
from pilotage.core.registry import Registry

Positive = Annotated[float, Field(gt=0.0)]
_ABOVE_ZERO = (
    ("top_speed_m_s", False),
    ("top_turn_rate_rad_s", False),
    ("curvature_rate_per_m_s", True),
    ("braking_m_s2", True),
    ("turn_acceleration_rad_s2", True),
)
"""Limits that are above 0, and whether they may be infinite."""


class MotionConfig(Config):
    """What every motion's data sheet says, whatever moves: its limits as a twist.

    A motion's config derives from this one; those whose limits follow from other numbers (a wheel drive's
    from its wheels) override the properties.

    Attributes
    ----------
    drives_sideways
        Whether it follows a lateral speed, which is recorded then.
    """

    drives_sideways: ClassVar[bool] = False

    delay_s: float = Field(default=0.0, ge=0.0, le=2.0)
    """From a command until the robot follows it: a multiple of the run's time step."""

    @model_validator(mode="after")
    def _limits_are_limits(self) -> Self:
        """Who plans and brakes divides by them; those of a motion from outside may be anything."""
        for name, may_be_infinite in _ABOVE_ZERO:
            value = getattr(self, name)
            wrong = unfit_number(value, unlimited=may_be_infinite) or ("" if value > 0.0 else str(value))
            if wrong:
                raise ValueError(f"expected {name} above 0, found {wrong}")
        for name in ("least_turning_radius_m", "top_lateral_m_s"):
            value = getattr(self, name)
            wrong = unfit_number(value) or ("" if value >= 0.0 else str(value))
            if wrong:
                raise ValueError(f"expected {name} from 0 to {LARGEST:g}, found {wrong}")
        return self

    @property
    def top_speed_m_s(self) -> float:
        """Fastest forward speed."""
        raise NotImplementedError

    @property
    def top_turn_rate_rad_s(self) -> float:
        """Fastest turn."""
        raise NotImplementedError

    @property
    def top_lateral_m_s(self) -> float:
        """Fastest speed to either side: of a base that drives sideways as fast as forwards, where it does not
        say another one."""
        return self.top_speed_m_s if self.drives_sideways else 0.0

    @property
    def least_turning_radius_m(self) -> float:
        """Radius of the tightest arc; 0 for who turns on the spot."""
        return 0.0

    @property
    def curvature_rate_per_m_s(self) -> float:
        """How fast it can change the curvature of its path; inf for who does so at once."""
        return math.inf

    @property
    def braking_m_s2(self) -> float:
        """Deceleration that it can be relied on for; inf for who stops at once."""
        return math.inf

    @property
    def turn_acceleration_rad_s2(self) -> float:
        """How fast it can change its turn rate; inf for who does so at once."""
        return math.inf

    @property
    def lag_s(self) -> float:
        """Time constant with which its rates follow their commands; 0 for who follows at once."""
        return 0.0


class LimitedMotionConfig(MotionConfig):
    """A motion whose speed and turn rate follow the command within limits of acceleration."""

    max_speed_m_s: Positive = 1.0
    max_turn_rate_rad_s: Positive = 2.0
    max_acceleration_m_s2: Positive = 2.0
    max_turn_acceleration_rad_s2: Positive = 8.0

    @property
    def top_speed_m_s(self) -> float:
        """Fastest forward speed."""
        return self.max_speed_m_s

    @property
    def top_turn_rate_rad_s(self) -> float:
        """Fastest turn."""
        return self.max_turn_rate_rad_s

    @property
    def braking_m_s2(self) -> float:
        """The acceleration limit holds for braking too."""
        return self.max_acceleration_m_s2

    @property
    def turn_acceleration_rad_s2(self) -> float:
        """How fast it can change its turn rate."""
        return self.max_turn_acceleration_rad_s2


MOTIONS: Registry[MotionConfig] = Registry("motion", "pilotage.models.motion")
"""Motion names to their data sheets; ``sim`` says for each what it truly does."""
