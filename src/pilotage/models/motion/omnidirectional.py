"""A base on Swedish or spherical wheels: any direction at any time."""

from __future__ import annotations

from pilotage.models.motion.motion import MOTIONS, MotionConfig, Positive


@MOTIONS.add_config("omnidirectional")
class OmnidirectionalConfig(MotionConfig):
    """Forward, lateral and turn speed follow the command within limits; the limits hold for each alone."""

    max_speed_m_s: Positive = 1.0
    max_lateral_m_s: Positive = 1.0
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
