"""A base on Swedish or spherical wheels: any direction at any time."""

from __future__ import annotations

from typing import ClassVar

from pilotage.models.motion.motion import MOTIONS, LimitedMotionConfig, Positive


@MOTIONS.add_config("omnidirectional")
class OmnidirectionalConfig(LimitedMotionConfig):
    """Forward, lateral and turn speed follow the command within limits; the limits hold for each alone."""

    drives_sideways: ClassVar[bool] = True

    max_lateral_m_s: Positive = 1.0

    @property
    def top_lateral_m_s(self) -> float:
        """Fastest speed to either side."""
        return self.max_lateral_m_s
