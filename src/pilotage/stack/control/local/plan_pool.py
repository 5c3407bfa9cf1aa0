"""The plans among which a robot chooses at every step, as far ahead as the place asks for."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.plan_pool import priced_pool
from pilotage.kernels.control.rollouts import Price
from pilotage.stack.control.local.gap_horizon_config import GapHorizonConfig
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.sampling import NoiseBank

SPEEDS = np.array([1.0, 0.7, 0.45, 0.25, 0.0])
"""Shares of the top speed at which its way is pursued; with none it turns to it on the spot, which no sample
does: who saw a quarter of the circle stood beside ground that it had but to turn to."""
LOOKS = np.array([[0.3, 0.1], [0.45, 0.3]])
TURN_IN_PLACE_RAD = 1.0
DODGES = np.array([(v, w) for v in (-0.5, 0.6, 1.2) for w in (-2.0, 0.0, 2.0)])
"""Speeds and turn rates held for a whole plan, out of the way of whoever comes: what pursuit of the path does
not think of."""
NONE_HELD = np.empty((0, 2))


class PlanPool:
    """Pursuits, dodges, the last plan and samples, priced; room for them is kept from step to step."""

    def __init__(self, config: GapHorizonConfig, generator: np.random.Generator) -> None:
        self._config = config
        self._near = _Samples(config, config.horizon_s, generator)
        self._far = _Samples(config, config.far_horizon_s, generator)
        self._since_sampled = config.resample_steps

    def priced(self, scene: Scene, price: Price, last: FloatArray | None) -> tuple[FloatArray, FloatArray]:
        """All plans (K, N, 2) worth a look with their costs, until the next call; ``last`` was chosen."""
        config = self._config
        samples = self._far if self._looks_far(scene) else self._near
        movers = scene.movers.foretold(scene.delay_s + config.step_s, config.step_s, samples.steps)
        self._since_sampled += 1
        draws = last is None or self._since_sampled >= config.resample_steps
        if draws:
            self._since_sampled = 0
        costs = priced_pool(
            scene.start,
            NONE_HELD if last is None else last,
            scene.dt_s / config.step_s,
            scene.path,
            LOOKS,
            SPEEDS * scene.drive.speed,
            TURN_IN_PLACE_RAD,
            DODGES if movers.shape[1] else NONE_HELD,
            samples.noise.draw() if draws else samples.silence,
            config.temperature_s,
            config.step_s,
            scene.drive,
            scene.body,
            scene.ground,
            movers,
            price,
            samples.commands,
            samples.plans,
        )
        return samples.plans[: len(costs)], costs

    def _looks_far(self, scene: Scene) -> bool:
        # Close to a goal of a narrow tolerance short plans stood still before it.
        if scene.distance_m < self._config.close_ahead_m:
            return True
        # Somebody may walk here, by the mission's word or by what was seen.
        people = self._config.ground.movers.enabled or math.isfinite(
            scene.movers.nearest_m(float(scene.pose[0]), float(scene.pose[1]))
        )
        if people:
            return True
        ahead = np.ascontiguousarray(scene.path[: max(3, round(self._config.close_ahead_m / 0.1))])
        return bool(path_distances(ahead, scene.ground).min() < scene.body.outer_m)


class _Samples:
    """Room for plans of one length: noise, what it makes of the best plan, and those worth a look."""

    def __init__(self, config: GapHorizonConfig, horizon_s: float, generator: np.random.Generator) -> None:
        self.steps = max(2, round(horizon_s / config.step_s))
        self.noise = NoiseBank(
            generator, config.rollouts, self.steps, config.speed_std_m_s, config.turn_std_rad_s
        )
        self.commands = np.empty((config.rollouts, self.steps, 2))
        most = 1 + len(SPEEDS) * len(LOOKS) + 1 + len(DODGES) + 2
        self.plans = np.empty((most, self.steps, 2))
        self.silence = np.empty((0, self.steps, 2))
