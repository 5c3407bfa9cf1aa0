"""MPPI: thousands of sampled plans, weighted by what they cost."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import Twist
from pilotage.kernels.control.rollouts import Price, later, rollout_costs, weighted_mean
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController
from pilotage.stack.control.local.sampling import NoiseBank


class MppiConfig(Config):
    """Samples, horizon and prices."""

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


@LOCAL_CONTROLLERS.add("mppi", MppiConfig)
class Mppi(RollingController):
    """Model predictive path integral control (Williams et al. 2017) on the seen ground.

    The mean of the samples, weighted by exp(-cost / temperature), is the next step's first guess. The mean of
    two ways around a post leads into it: nothing here checks the command itself.
    """

    def __init__(self, config: MppiConfig, generator: np.random.Generator) -> None:
        super().__init__(config.ground, foresees=True)
        self._config = config
        self._steps = max(2, round(config.horizon_s / config.step_s))
        self._noise = NoiseBank(
            generator, config.rollouts, self._steps, config.speed_std_m_s, config.turn_std_rad_s
        )
        self._commands = np.empty((config.rollouts, self._steps, 2))
        self._mean = np.zeros((self._steps, 2))

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        config = self._config
        price = Price(
            config.margin_m,
            0.0,
            config.soft_m,
            config.near_cost,
            config.heading_s_per_rad,
            config.turning_cost_s,
            config.reverse_cost,
            config.no_stop_s,
            float(scene.goal[0]),
            float(scene.goal[1]),
            view.goal_tolerance_m,
            1.0,
            config.people_cost,
            config.comfort_m,
        )
        mean = later(self._mean, scene.dt_s / config.step_s)
        costs = rollout_costs(
            scene.start,
            mean,
            self._noise.draw(),
            config.step_s,
            scene.drive,
            scene.body,
            scene.ground,
            scene.movers.foretold(scene.delay_s + config.step_s, config.step_s, self._steps),
            price,
            self._commands,
        )
        self._mean = weighted_mean(self._commands, costs, config.temperature_s)
        return Twist(float(self._mean[0, 0]), float(self._mean[0, 1]))
