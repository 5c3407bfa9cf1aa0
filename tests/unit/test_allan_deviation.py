"""The Allan deviation of white noise is known at every averaging time, the shortest too."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.calibration.gyroscope import allan_deviation


def test_white_noise_falls_with_the_root_of_the_averaging_time() -> None:
    rng = np.random.default_rng(4)
    std, step = 0.02, 0.01
    t_s = np.arange(20_000) * np.float64(step)
    rate = np.full(t_s.shape[0], 0.5) + std * rng.standard_normal(t_s.shape[0])
    found = allan_deviation(t_s, rate)
    short = found.tau_s < 0.2
    assert found.tau_s[0] == pytest.approx(step)
    # The relative error of a variance from n / m values is sqrt(3 m / n) at most: below 4 % for m <= 20.
    expected = std * np.sqrt(step / found.tau_s)
    assert found.deviation_rad_s[short] == pytest.approx(expected[short], rel=0.06)
