"""Move to a pose in polar coordinates (rover report, chapter 2; Corke 2017, section 4.1.1.4)."""

from __future__ import annotations

import math

from pydantic import model_validator

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import Pose2, Twist
from pilotage.models.motion.motion import MotionConfig

ALPHA_RATIO, BETA_RATIO = 1.5 / 1.3, -1.9 / 1.3
"""The report's gains over its K_rho."""
MOST_A_STEP = 0.1
"""Share of the way to go that it drives in a time step."""


class PolarPoseConfig(Config):
    """Gains in 1/s; those that cannot be stable are refused.

    What is not given follows from another one by the report's ratios; where none is, K_rho is such that it
    asks for no faster turn than the robot can make, wherever the goal lies, nor for harder braking, and that
    it is slow beside the time steps in which it is asked.
    """

    rho_gain_per_s: float | None = None
    alpha_gain_per_s: float | None = None
    beta_gain_per_s: float | None = None

    @model_validator(mode="after")
    def _stable(self) -> PolarPoseConfig:
        """The linearized loop is stable for K_rho > 0, K_beta < 0, K_alpha > K_rho."""
        rho, alpha, beta = self.rho_gain_per_s, self.alpha_gain_per_s, self.beta_gain_per_s
        if rho is not None and not rho > 0.0:
            raise ValueError(f"rho_gain_per_s: the loop is stable for K_rho > 0 only, found {rho:g}")
        if beta is not None and not beta < 0.0:
            raise ValueError(f"beta_gain_per_s: the loop is stable for K_beta < 0 only, found {beta:g}")
        least = (0.0 if beta is None or alpha is None else beta / BETA_RATIO) if rho is None else rho
        if alpha is not None and not alpha > least:
            raise ValueError(
                f"alpha_gain_per_s: the loop is stable for K_alpha > K_rho only, found {alpha:g} with "
                f"K_rho = {least:g}"
            )
        return self

    def gains_per_s(self, motion: MotionConfig, dt_s: float) -> tuple[float, float, float]:
        """K_rho, K_alpha and K_beta for a robot."""
        rho, alpha, beta = self.rho_gain_per_s, self.alpha_gain_per_s, self.beta_gain_per_s
        if rho is None and beta is not None:
            rho = beta / BETA_RATIO
        elif rho is None and alpha is not None:
            rho = alpha / ALPHA_RATIO
        elif rho is None:
            turning = motion.top_turn_rate_rad_s / (math.pi * (ALPHA_RATIO - BETA_RATIO))
            rho = min(turning, motion.braking_m_s2 / motion.top_speed_m_s, MOST_A_STEP / dt_s)
        return (
            rho,
            ALPHA_RATIO * rho if alpha is None else alpha,
            BETA_RATIO * rho if beta is None else beta,
        )


class PolarPoseController:
    """Steers by distance and two angles to a goal pose (equations 2.3 to 2.8).

    Fails where the goal lies behind: it never drives backwards, so it makes a wide turn. The speed is cut
    off at its limit while the turn rate is not, as in the report: far away the path is the straighter.
    """

    def __init__(self, config: PolarPoseConfig, goal: Pose2, motion: MotionConfig, dt_s: float) -> None:
        self._gains_per_s, self._top_speed_m_s = config.gains_per_s(motion, dt_s), motion.top_speed_m_s
        self._goal = goal

    def distance_m(self, x_m: float, y_m: float) -> float:
        """What is left to the goal, rho (equation 2.3)."""
        return math.hypot(self._goal.x_m - x_m, self._goal.y_m - y_m)

    def command(self, x_m: float, y_m: float, theta_rad: float) -> Twist:
        """The twist at a pose."""
        goal, (k_rho, k_alpha, k_beta) = self._goal, self._gains_per_s
        dx, dy = goal.x_m - x_m, goal.y_m - y_m
        rho = math.hypot(dx, dy)
        alpha = wrap_to_pi(math.atan2(dy, dx) - theta_rad)  # eq. 2.4
        beta = wrap_to_pi(-alpha - theta_rad + goal.theta_rad)  # eq. 2.5
        v = min(k_rho * rho, self._top_speed_m_s)  # eq. 2.7
        w = k_alpha * alpha + k_beta * beta  # eq. 2.8
        return Twist(v, w)
