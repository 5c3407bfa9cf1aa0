"""Noise for sampled plans, drawn once."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

STEPS_KEPT = 16
"""Noise for so many steps is drawn beforehand; each step takes a random stretch of it."""
MOST_COMMANDS = 1_000_000
"""Rollouts times steps; half a gigabyte of noise."""
KEEP = 0.8
"""Of a command's noise goes on in the next command: independent noise would average out in the motion."""


class NoiseBank:
    """Noise sequences (rollouts, steps, 2) for speed and turn rate, from the generator handed in."""

    def __init__(
        self,
        generator: np.random.Generator,
        rollouts: int,
        steps: int,
        speed_std_m_s: float,
        turn_std_rad_s: float,
    ) -> None:
        if rollouts * steps > MOST_COMMANDS:
            raise InputError(
                f"stack.local_controller: expected at most {MOST_COMMANDS:,} commands to sample (rollouts "
                f"times horizon_s / step_s), found {rollouts * steps:,}; take a longer step_s"
            )
        self._generator = generator
        self._rollouts = rollouts
        noise = generator.standard_normal((STEPS_KEPT * rollouts, steps, 2))
        self._bank = _hanging_together(noise) * np.array([speed_std_m_s, turn_std_rad_s])

    def draw(self) -> FloatArray:
        """The next step's noise."""
        offset = int(self._generator.integers(0, self._bank.shape[0] - self._rollouts + 1))
        noise: FloatArray = self._bank[offset : offset + self._rollouts]
        return noise


def _hanging_together(noise: FloatArray) -> FloatArray:
    """White noise (K, N, 2) as an AR(1) process along its second axis, still of unit variance."""
    out = np.empty_like(noise)
    out[:, 0] = noise[:, 0]
    for k in range(1, noise.shape[1]):
        out[:, k] = KEEP * out[:, k - 1] + np.sqrt(1.0 - KEEP**2) * noise[:, k]
    return out
