"""The fit of the small robot's faults: one drawn robot is driven and summarized as the fit needs it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks import romi_fit


def test_a_drawn_robot_is_summarized(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(romi_fit, "LONGEST_S", 30.0)
    robot = romi_fit.drawn(np.random.default_rng(0), None)
    found, reason = romi_fit.trial(robot, "exploration, fusion", 0)
    printed, *_, visited, right, duration_s = found
    assert reason
    assert 0.0 < right <= min(printed, visited)
    assert 0.0 < duration_s <= 30.0
    assert all(math.isfinite(value) for value in found)
