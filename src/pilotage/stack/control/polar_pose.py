"""Move to a pose in polar coordinates (rover report, chapter 2; Corke 2017, section 4.1.1.4)."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.registry import Registry
from pilotage.core.types import Pose2, Twist
from pilotage.sensors.sensor import Positive


class PolarPoseConfig(Config):
    """Gains in 1/s, and limits. Gains that cannot be stable are refused."""

    rho_gain_per_s: float = 1.3e-3
    alpha_gain_per_s: float = 1.5e-3
    beta_gain_per_s: float = -1.9e-3
    max_speed_m_s: Positive = 0.04
    wheelbase_m: Positive = 3.0
    max_steering_rad: float | None = Field(default=None, gt=0.0, lt=0.5 * math.pi)
    """Of the bicycle's front wheel; None: no limit, as in the report."""

    @model_validator(mode="after")
    def _stable(self) -> PolarPoseConfig:
        """The linearized loop is stable for K_rho > 0, K_beta < 0, K_alpha > K_rho."""
        if not self.rho_gain_per_s > 0.0:
            raise ValueError(
                f"rho_gain_per_s: the loop is stable for K_rho > 0 only, found {self.rho_gain_per_s:g}"
            )
        if not self.beta_gain_per_s < 0.0:
            raise ValueError(
                f"beta_gain_per_s: the loop is stable for K_beta < 0 only, found {self.beta_gain_per_s:g}"
            )
        if not self.alpha_gain_per_s > self.rho_gain_per_s:
            raise ValueError(
                f"alpha_gain_per_s: the loop is stable for K_alpha > K_rho only, found "
                f"{self.alpha_gain_per_s:g} with K_rho = {self.rho_gain_per_s:g}"
            )
        return self


POSE_CONTROLLERS: Registry[PolarPoseController] = Registry("pose_controller", "pilotage.stack.control")
"""Laws that lead to a pose; built as ``cls(config, goal)``."""


class PolarPoseController:
    """Steers by distance and two angles to a goal pose (equations 2.3 to 2.8).

    Fails where the goal lies behind: it never drives backwards, so it makes a wide turn. The speed is cut
    off at its limit while the turn rate is not, as in the report: far away the path is the straighter.
    """

    def __init__(self, config: PolarPoseConfig, goal: Pose2) -> None:
        self._config = config
        self._goal = goal

    def distance_m(self, x_m: float, y_m: float) -> float:
        """What is left to the goal, rho (equation 2.3)."""
        return math.hypot(self._goal.x_m - x_m, self._goal.y_m - y_m)

    def command(self, x_m: float, y_m: float, theta_rad: float) -> Twist:
        """The twist at a pose."""
        config, goal = self._config, self._goal
        dx, dy = goal.x_m - x_m, goal.y_m - y_m
        rho = math.hypot(dx, dy)
        alpha = wrap_to_pi(math.atan2(dy, dx) - theta_rad)  # eq. 2.4
        beta = wrap_to_pi(-alpha - theta_rad + goal.theta_rad)  # eq. 2.5
        v = min(config.rho_gain_per_s * rho, config.max_speed_m_s)  # eq. 2.7
        w = config.alpha_gain_per_s * alpha + config.beta_gain_per_s * beta  # eq. 2.8
        if config.max_steering_rad is not None:
            most = v * math.tan(config.max_steering_rad) / config.wheelbase_m
            w = min(max(w, -most), most)
        return Twist(v, w)

    def steering_rad(self, twist: Twist) -> float:
        """The bicycle's steering angle of a twist: tan(gamma) = w L / v (equation 1.1)."""
        return math.atan2(twist.w_rad_s * self._config.wheelbase_m, twist.v_m_s)


POSE_CONTROLLERS.add("polar", PolarPoseConfig)(PolarPoseController)
