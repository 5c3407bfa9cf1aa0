"""Move to a pose in polar coordinates (rover report, chapter 2; Corke 2017, section 4.1.1.4)."""

from __future__ import annotations

import math

from pydantic import model_validator

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist


class PolarPoseConfig(Config):
    """Gains in 1/s. Gains that cannot be stable are refused."""

    rho_gain_per_s: float = 1.3e-3
    alpha_gain_per_s: float = 1.5e-3
    beta_gain_per_s: float = -1.9e-3

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


class PolarPoseController:
    """Steers by distance and two angles to a goal pose (equations 2.3 to 2.8).

    Fails where the goal lies behind: it never drives backwards, so it makes a wide turn. The speed is cut
    off at its limit while the turn rate is not, as in the report: far away the path is the straighter.
    """

    def __init__(self, config: PolarPoseConfig, goal: Pose2, top_speed_m_s: float) -> None:
        self._config, self._top_speed_m_s = config, top_speed_m_s
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
        v = min(config.rho_gain_per_s * rho, self._top_speed_m_s)  # eq. 2.7
        w = config.alpha_gain_per_s * alpha + config.beta_gain_per_s * beta  # eq. 2.8
        return Twist(v, w)
