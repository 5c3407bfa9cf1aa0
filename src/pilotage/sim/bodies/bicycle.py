"""A car: its steering angle follows the twist's curvature within limits of angle and rate."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command
from pilotage.kernels.bodies.drive import CONTACT_M
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.rates import approach
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS, as_twist


@SIMULATED_MOTIONS.add(BicycleConfig)
class Bicycle:
    """The kinematic bicycle, theta' = v tan(steering) / wheelbase (Siegwart et al. 2011, section 3.2).

    Within a step speed and steering are constant, so the rear axle drives an exact arc.

    Attributes
    ----------
    steering_rad
        Of the front wheel now, to the left.
    """

    spins_on = False
    release_m = CONTACT_M
    turned_rad = None

    def __init__(
        self, config: BicycleConfig, dt_s: float, samples: int, streams: RandomStreams, where: str
    ) -> None:
        del samples, streams
        self.moves = np.zeros((1, 3))
        self.steering_rad = 0.0
        self._config, self._dt_s, self._where = config, dt_s, where
        self._v = 0.0

    def command(self, command: Command) -> None:
        """One arc; who asks for a turn on the spot gets the wheels turned that way and no more."""
        twist, c, dt_s = as_twist(command, self._where), self._config, self._dt_s
        wanted = self.steering_rad
        if twist.v_m_s != 0.0:
            wanted = math.atan(c.wheelbase_m * twist.w_rad_s / twist.v_m_s)
        elif twist.w_rad_s != 0.0:
            wanted = math.copysign(c.max_steering_rad, twist.w_rad_s)
        self.steering_rad = approach(
            self.steering_rad, wanted, c.max_steering_rad, c.max_steering_rate_rad_s * dt_s
        )
        self._v = approach(self._v, twist.v_m_s, c.max_speed_m_s, c.max_acceleration_m_s2 * dt_s)
        self.moves[0, 0] = self._v * dt_s
        self.moves[0, 2] = self._v * dt_s * math.tan(self.steering_rad) / c.wheelbase_m

    def stop(self) -> None:
        """Stand still; the wheels stay turned."""
        self._v = 0.0
