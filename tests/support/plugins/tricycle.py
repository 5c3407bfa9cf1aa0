"""A plugin: a tricycle whose front wheel steers and drives."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command
from pilotage.models.motion.motion import MOTIONS, MotionConfig, Positive
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS, as_twist


@MOTIONS.add_config("tricycle")
class TricycleConfig(MotionConfig):
    """The front wheel turns as far as it likes; it sits this far ahead of the rear axle."""

    wheelbase_m: Positive = 0.4
    max_wheel_speed_m_s: Positive = 1.0

    @property
    def top_speed_m_s(self) -> float:
        """The front wheel straight ahead."""
        return self.max_wheel_speed_m_s

    @property
    def top_turn_rate_rad_s(self) -> float:
        """The front wheel across."""
        return self.max_wheel_speed_m_s / self.wheelbase_m


@SIMULATED_MOTIONS.add(TricycleConfig)
class Tricycle:
    """Within a step the wheel's speed and angle are constant."""

    spins_on = False
    release_m = 1e-6
    turned_rad = None

    def __init__(
        self, config: TricycleConfig, dt_s: float, samples: int, streams: RandomStreams, where: str
    ) -> None:
        del samples, streams
        self.moves = np.zeros((1, 3))
        self._config, self._dt_s, self._where = config, dt_s, where

    def command(self, command: Command) -> None:
        """One arc, the wheel no faster than it can."""
        twist = as_twist(command, self._where)
        wheel = math.hypot(twist.v_m_s, twist.w_rad_s * self._config.wheelbase_m)
        share = self._dt_s * min(1.0, self._config.max_wheel_speed_m_s / max(wheel, 1e-12))
        self.moves[0] = share * twist.v_m_s, 0.0, share * twist.w_rad_s

    def stop(self) -> None:
        """Stand still: it keeps no speed."""
