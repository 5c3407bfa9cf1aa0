"""A base that drives in any direction and turns at once."""

from __future__ import annotations

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command
from pilotage.kernels.bodies.drive import CONTACT_M
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.models.motion.rates import approach
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS, as_twist


@SIMULATED_MOTIONS.add(OmnidirectionalConfig)
class Omnidirectional:
    """Forward, lateral and turn speed are limited each for itself; within a step they are constant."""

    spins_on = False
    release_m = CONTACT_M
    turned_rad = None

    def __init__(
        self, config: OmnidirectionalConfig, dt_s: float, samples: int, streams: RandomStreams, where: str
    ) -> None:
        del samples, streams
        self.moves = np.zeros((1, 3))
        self._config, self._dt_s, self._where = config, dt_s, where
        self._v = self._lateral = self._w = 0.0

    def command(self, command: Command) -> None:
        """One move at constant twist."""
        twist, c, dt_s = as_twist(command, self._where), self._config, self._dt_s
        change = c.max_acceleration_m_s2 * dt_s
        self._v = approach(self._v, twist.v_m_s, c.max_speed_m_s, change)
        self._lateral = approach(self._lateral, twist.lateral_m_s, c.max_lateral_m_s, change)
        turn_change = c.max_turn_acceleration_rad_s2 * dt_s
        self._w = approach(self._w, twist.w_rad_s, c.max_turn_rate_rad_s, turn_change)
        self.moves[0] = self._v * dt_s, self._lateral * dt_s, self._w * dt_s

    def stop(self) -> None:
        """Stand still."""
        self._v = self._lateral = self._w = 0.0
