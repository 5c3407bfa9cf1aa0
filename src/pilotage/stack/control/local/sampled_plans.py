"""What controllers that sample plans draw, and what a plan costs."""

from __future__ import annotations

from pydantic import Field

from pilotage.core.config import Config
from pilotage.kernels.control.rollouts import Price
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig


class SampledPlansConfig(Config):
    """Horizon, samples and what a plan costs beside its time."""

    ground: RollingConfig = RollingConfig()
    horizon_s: Positive = 2.0
    step_s: Positive = 0.1
    rollouts: int = Field(default=1000, ge=8, le=20000)
    speed_std_m_s: Positive = 0.5
    turn_std_rad_s: Positive = 1.2
    temperature_s: Positive = 0.1
    margin_m: NonNegative = 0.05
    soft_m: Positive = 0.15
    near_cost: NonNegative = 1.0
    heading_s_per_rad: NonNegative = 0.25
    turning_cost_s: NonNegative = 0.01
    reverse_cost: NonNegative = 1.0
    no_stop_s: NonNegative = 30.0
    people_cost: NonNegative = 1.5
    comfort_m: Positive = 0.5

    def price(self, view: LocalView, scene: Scene, margin_s: float, trust: float) -> Price:
        """As kernels take it: ``margin_s`` is kept more per m/s, ``trust`` the share of braking relied on."""
        return Price(
            self.margin_m,
            margin_s,
            self.soft_m,
            self.near_cost,
            self.heading_s_per_rad,
            self.turning_cost_s,
            self.reverse_cost,
            self.no_stop_s,
            float(scene.goal[0]),
            float(scene.goal[1]),
            view.goal_tolerance_m,
            trust,
            self.people_cost,
            self.comfort_m,
        )
