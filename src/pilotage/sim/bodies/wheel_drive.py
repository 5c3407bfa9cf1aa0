"""A differential drive by wheel speeds, with motor lag, unequal wheels and slip."""

from __future__ import annotations

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Command, FloatArray, WheelSpeeds
from pilotage.kernels.bodies import wheels
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS

BLOCK_NUMBERS = 2_000_000
"""Steps whose slip is drawn at once, for all wheels and samples, are so many numbers at most,"""
BLOCK = 2048
"""and so many steps."""
OWN_RATE_HZ = 100.0
"""The wheels are followed this often at least, where no sensor samples them more often."""


@SIMULATED_MOTIONS.add(WheelDriveConfig)
class WheelDrive:
    """The robot's true wheels are not those of its data sheet; see ``WheelErrorsConfig``.

    At a contact they spin on: encoders do not feel it. A twist is followed by the wheel speeds that the data
    sheet gives for it, both slowed down alike where one is too fast.
    """

    spins_on = True

    def __init__(
        self, config: WheelDriveConfig, dt_s: float, samples: int, streams: RandomStreams, where: str
    ) -> None:
        del where
        self._config = config
        if samples == 1:
            samples = max(1, round(dt_s * OWN_RATE_HZ))
        self._period_s = dt_s / samples
        # It stops up to a sample's path before what it runs into.
        self.release_m = max(1e-3, 1.5 * config.top_speed_m_s * self._period_s)
        self._samples = samples
        self.moves = np.zeros((samples, 3))
        self._wheels = np.zeros(wheels.STATE_SIZE)
        self._parameters = true_wheels(config, streams.stream("drive"))
        self._slip_rng = streams.stream("slip")
        self._slip: FloatArray = np.zeros((0, samples, 2))
        self._at = self._block = max(1, min(BLOCK, BLOCK_NUMBERS // (2 * samples)))

    @property
    def turned_rad(self) -> tuple[float, float]:
        """Angles that the left and the right wheel have turned so far."""
        return float(self._wheels[wheels.TURNED_LEFT]), float(self._wheels[wheels.TURNED_RIGHT])

    def command(self, command: Command) -> None:
        """One short move for each sample."""
        if self._at == self._block:
            self._slip = self._slip_rng.standard_normal((self._block, self._samples, 2))
            self._at = 0
        if type(command) is not WheelSpeeds:
            command = self._wheel_speeds(command)
        most = self._config.max_wheel_speed_rad_s
        wheels.moves(
            self._wheels,
            min(max(command.left_rad_s, -most), most),
            min(max(command.right_rad_s, -most), most),
            self._parameters,
            self._period_s,
            self._slip[self._at],
            self.moves,
        )
        self._at += 1

    def stop(self) -> None:
        """Stand still."""
        self._wheels[wheels.SPEED_LEFT] = self._wheels[wheels.SPEED_RIGHT] = 0.0

    def _wheel_speeds(self, command: Command) -> WheelSpeeds:
        assert not isinstance(command, WheelSpeeds)
        c = self._config
        half = 0.5 * c.wheel_separation_m * command.w_rad_s
        left, right = (command.v_m_s - half) / c.wheel_radius_m, (command.v_m_s + half) / c.wheel_radius_m
        slower = min(1.0, c.max_wheel_speed_rad_s / max(abs(left), abs(right), 1e-12))
        return WheelSpeeds(slower * left, slower * right)


def true_wheels(config: WheelDriveConfig, rng: np.random.Generator) -> FloatArray:
    """The drive's true parameters, drawn as ``WheelErrorsConfig`` says; see ``kernels.bodies.wheels``."""
    errors = config.errors
    larger_left, wider = rng.choice([-1.0, 1.0], 2)
    half = 0.5 * errors.radius_difference * larger_left
    separation = wider * rng.uniform(*errors.separation_error)
    slip_left, slip_right = rng.uniform(*errors.slip, size=2)
    return np.array(
        [
            config.wheel_radius_m * (1.0 + half),
            config.wheel_radius_m * (1.0 - half),
            config.wheel_separation_m * (1.0 + separation),
            slip_left,
            slip_right,
            errors.slip_std_m_sqrt_m,
            config.motor_lag_s,
        ]
    )
