"""Sensors that are read in samples, several in a step: wheel encoders and gyroscope."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.bodies import wheels
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.readings import EncoderCounts, GyroscopeRates
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier

BLOCK, BLOCK_NUMBERS = 2048, 2_000_000
"""Noise is drawn for so many steps at once, of few samples; in all for so many samples at most."""


@SIMULATED_SENSORS.add(WheelEncodersConfig)
class SimulatedWheelEncoders:
    """Whole counts of each wheel, spread over the samples as evenly as whole counts go."""

    sampled = True

    def __init__(self, config: WheelEncodersConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        del rng
        self._motion = carrier.body.motion
        if self._motion.turned_rad is None:
            raise InputError(
                f"{carrier.where}: wheel-encoders need a motion whose wheels are known, such as wheel-drive; "
                f"take wheel-odometry instead"
            )
        self._counts_per_turn = config.counts_per_turn
        self._samples = config.samples(carrier.dt_s)
        self._counted = np.zeros(2, dtype=np.int64)

    def read(self) -> EncoderCounts:
        """Counts since the last reading."""
        turned = self._motion.turned_rad
        assert turned is not None, "looked at when it was built"
        counts = wheels.read_counts(*turned, self._counted, self._counts_per_turn, self._samples)
        return EncoderCounts(counts[0], counts[1])


@SIMULATED_SENSORS.add(GyroscopeConfig)
class SimulatedGyroscope:
    """Adds bias, drift, scale error and noise to true rates.

    On a motion that is followed in fewer samples than the gyroscope takes, several samples see one rate.
    """

    sampled = True

    def __init__(self, config: GyroscopeConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self._samples = config.samples(carrier.dt_s)
        self._true = carrier.body.rates_rad_s
        fine = len(self._true)
        if fine % self._samples and self._samples % fine:
            raise InputError(
                f"{carrier.where}.rate_hz: expected a whole part of {fine / carrier.dt_s:g} Hz, at which the "
                f"robot's fastest sensor is sampled, found {config.rate_hz:g}"
            )
        signs = rng.choice([-1.0, 1.0], 2)
        self._bias = signs[0] * config.bias_rad_s
        self._scale = 1.0 + signs[1] * config.scale_error
        self._walk, self._std = config.bias_walk_rad_s_sqrt_s, config.rate_std_rad_s
        self._rng, self._period_s = rng, carrier.period_s
        self._at = self._block = max(1, min(BLOCK, BLOCK_NUMBERS // self._samples))
        self._noise: FloatArray = np.zeros((0, self._samples))
        self._steps: FloatArray = np.zeros(0)

    def read(self) -> GyroscopeRates:
        """Rates of the last step's samples."""
        if self._at == self._block:
            block = self._block
            self._noise = self._std * self._rng.standard_normal((block, self._samples))
            self._steps = self._walk * math.sqrt(self._period_s) * self._rng.standard_normal(block)
            self._at = 0
        self._bias += float(self._steps[self._at])
        rates = self._true
        if len(rates) < self._samples:
            rates = np.repeat(rates, self._samples // len(rates))
        elif len(rates) > self._samples:
            rates = rates.reshape(self._samples, -1).mean(axis=1)
        reading = self._scale * rates + self._bias + self._noise[self._at]
        self._at += 1
        return GyroscopeRates(reading)
