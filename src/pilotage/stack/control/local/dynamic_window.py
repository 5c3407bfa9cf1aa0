"""Dynamic window approach with acceleration limits, led by the time to go."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import Twist
from pilotage.kernels.control.dynamic_window import choose_in_window
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController


class DwaConfig(Config):
    """The window's grid, how far its arcs are looked at, and what they cost."""

    ground: RollingConfig = RollingConfig()
    horizon_s: float = Field(default=1.2, gt=0.0, le=100.0)
    window_s: Positive = 0.25
    """The window spans what can be reached in this time; the command is held until the next step."""
    speeds: int = Field(default=9, ge=2, le=101)
    turns: int = Field(default=21, ge=3, le=201)
    margin_m: NonNegative = 0.03
    soft_m: Positive = 0.2
    near_cost_s: NonNegative = 1.0
    heading_s_per_rad: NonNegative = 0.3
    slow_cost_s: NonNegative = 0.2


@LOCAL_CONTROLLERS.add("dwa", DwaConfig)
class Dwa(RollingController):
    """The best arc of constant rates among those within reach that can still stop (Fox et al. 1997).

    The goal's direction in the objective is replaced by the time to go, as with a global planner behind it.
    Fails where only a way of two arcs leads on: it stops short and turns on the spot.
    """

    def __init__(self, config: DwaConfig, generator: np.random.Generator) -> None:
        del generator  # nothing here is drawn
        super().__init__(config.ground)
        self._config = config

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        del view
        config = self._config
        v, w, _ = choose_in_window(
            scene.start,
            config.window_s,
            config.horizon_s,
            config.speeds,
            config.turns,
            scene.drive,
            scene.body,
            scene.ground,
            config.margin_m,
            config.soft_m,
            config.near_cost_s,
            config.heading_s_per_rad,
            config.slow_cost_s,
        )
        return Twist(v, w)
