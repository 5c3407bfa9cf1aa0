"""How wrong the motion is that a robot's commands foretell, learnt from the odometry."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.localization.odometry_prediction import OdometryNoise, OdometryPrediction

UNMODELLED = 0.1
"""Of what a robot could drive from rest in a period: the standard deviation of what it does otherwise than
commanded, before anything is known of that."""
FADE_S = 10.0
"""What commands were wrong by so long ago counts less by e: the ground may change."""


class CommandError:
    """Rates beside those commanded, u, as an autoregressive process by increments: u_k = phi u_(k-1) + e_k.

    By axis, over the increments so far with a fading f: phi = sum f u_k u_(k-1) / sum f u_(k-1)^2 from 0 to 1
    (Box and Jenkins 1976, section 3.2). A robot that obeys has a phi of 0, one that does not answer goes on
    as it went. The innovations e are taken for white; their spectral density is
    q = sum f (e^2 T^2 - R) / sum f T, T an increment's period and R the odometry's own variance of it (the
    noise of a model, estimated from its innovations; Bar-Shalom et al. 2001, section 11.5). By chance alone
    its sum has the standard deviation sqrt(2 sum f^2 R^2), which is believed besides: smaller errors the
    odometry does not show.

    Too small for the period in which the robot first does other than told.
    """

    def __init__(self, motion: MotionConfig, sensor: WheelOdometryConfig) -> None:
        period_s = 1.0 / sensor.rate_hz
        self._odometry = OdometryPrediction(sensor, OdometryNoise(), 1.0, OdometryModel.EXACT_ARC)
        self._top = np.array([motion.top_speed_m_s, motion.top_speed_m_s, motion.top_turn_rate_rad_s])
        change = np.array([motion.braking_m_s2, motion.braking_m_s2, motion.turn_acceleration_rad_s2])
        could = np.minimum(self._top * period_s, 0.5 * change * period_s**2)
        self._excess, self._chance_var = (UNMODELLED * could) ** 2, np.zeros(3)
        self._over_s = period_s
        self._beside, self._lasting, self._squares = np.zeros(3), np.zeros(3), np.full(3, 1e-12)

    def tell(self, increment: OdometryIncrement, commanded: FloatArray, over_s: float) -> None:
        """An increment over a time, and what was commanded in it (3,): ahead, left, turn."""
        told = np.array([increment.distance_m, increment.lateral_m, increment.angle_rad])
        ahead, turn = self._odometry.variances(increment)
        own = np.array([ahead, self._odometry.lateral_variance(increment), turn])
        # What cannot have been driven says nothing of how commands are followed.
        beside = np.clip((told - commanded) / over_s, -2.0 * self._top, 2.0 * self._top)
        fade = math.exp(-over_s / FADE_S)
        self._excess = fade * self._excess + ((beside - self.rates) * over_s) ** 2 - own
        self._chance_var = fade**2 * self._chance_var + 2.0 * own**2
        self._over_s = fade * self._over_s + over_s
        self._lasting = fade * self._lasting + beside * self._beside
        self._squares = fade * self._squares + self._beside**2
        self._beside = beside

    @property
    def rates(self) -> FloatArray:
        """(3,) foretold beside those commanded: ahead and to the left (m/s), turn (rad/s)."""
        phi: FloatArray = np.clip(self._lasting / self._squares, 0.0, 1.0)
        return phi * self._beside

    @property
    def densities(self) -> FloatArray:
        """(3,) of the displacement ahead and to the left (m^2/s) and of the turn (rad^2/s)."""
        found: FloatArray = (np.maximum(self._excess, 0.0) + np.sqrt(self._chance_var)) / self._over_s
        return found
