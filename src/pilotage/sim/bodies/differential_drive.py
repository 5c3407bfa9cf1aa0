"""A differential drive that follows twists within its limits."""

from __future__ import annotations

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command
from pilotage.kernels.bodies.drive import CONTACT_M
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.rates import approach
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS, as_twist


@SIMULATED_MOTIONS.add(DifferentialDriveConfig)
class DifferentialDrive:
    """Speed and turn rate are limited, and so is how fast they change; within a step they are constant."""

    spins_on = False
    release_m = CONTACT_M
    turned_rad = None

    def __init__(
        self, config: DifferentialDriveConfig, dt_s: float, samples: int, streams: RandomStreams, where: str
    ) -> None:
        del samples, streams
        self.moves = np.zeros((1, 3))
        self._limits = (config.max_speed_m_s, config.max_turn_rate_rad_s)
        self._changes = (config.max_acceleration_m_s2 * dt_s, config.max_turn_acceleration_rad_s2 * dt_s)
        self._dt_s, self._where = dt_s, where
        self._v = self._w = 0.0

    def command(self, command: Command) -> None:
        """One arc."""
        twist = as_twist(command, self._where)
        self._v = approach(self._v, twist.v_m_s, self._limits[0], self._changes[0])
        self._w = approach(self._w, twist.w_rad_s, self._limits[1], self._changes[1])
        self.moves[0] = self._v * self._dt_s, 0.0, self._w * self._dt_s

    def stop(self) -> None:
        """Stand still."""
        self._v = self._w = 0.0
