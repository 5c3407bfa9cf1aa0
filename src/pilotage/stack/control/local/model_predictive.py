"""MPPI: thousands of sampled plans, weighted by what they cost."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import Twist
from pilotage.kernels.control.rollouts import later, rollout_costs, weighted_mean
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_step import RollingController
from pilotage.stack.control.local.sampled_plans import SampledPlansConfig
from pilotage.stack.control.local.sampling import NoiseBank


class MppiConfig(SampledPlansConfig):
    """Thousands of samples of a long horizon."""


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
            config.price(view, scene, 0.0, 1.0),
            self._commands,
        )
        self._mean = weighted_mean(self._commands, costs, config.temperature_s)
        return Twist(float(self._mean[0, 0]), float(self._mean[0, 1]))
