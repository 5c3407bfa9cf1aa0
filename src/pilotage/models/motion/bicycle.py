"""A car: one steered axle ahead of a driven one (Siegwart et al. 2011, 3.2; rover report 1.1)."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.models.motion.motion import MOTIONS, MotionConfig, Positive


@MOTIONS.add_config("bicycle")
class BicycleConfig(MotionConfig):
    """The rear axle's middle is the base; a twist asks for the steering angle atan(wheelbase w / v).

    Steering is limited in angle and rate, speed in acceleration; at standstill the wheels stay as they are
    unless a turn is asked for, which a car cannot do.
    """

    wheelbase_m: Positive = 0.5
    max_speed_m_s: Positive = 1.0
    max_steering_rad: float = Field(default=0.6, gt=0.0, lt=math.pi / 2.0)
    max_steering_rate_rad_s: Positive = 1.0
    max_acceleration_m_s2: Positive = 1.0

    @property
    def top_speed_m_s(self) -> float:
        """Fastest forward speed."""
        return self.max_speed_m_s

    @property
    def top_turn_rate_rad_s(self) -> float:
        """Fastest turn: top speed on the tightest arc."""
        return self.max_speed_m_s / self.least_turning_radius_m

    @property
    def least_turning_radius_m(self) -> float:
        """Wheelbase over the tangent of the largest steering angle."""
        return self.wheelbase_m / math.tan(self.max_steering_rad)

    @property
    def curvature_rate_per_m_s(self) -> float:
        """That of wheels that stand straight: curvature is tan(steering) over wheelbase."""
        return self.max_steering_rate_rad_s / self.wheelbase_m

    @property
    def braking_m_s2(self) -> float:
        """The acceleration limit holds for braking too."""
        return self.max_acceleration_m_s2
