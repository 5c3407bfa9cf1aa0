"""Position errors split by what drives the robot and by the room around it."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.evaluation.driving import split_errors
from pilotage.stack.navigator.goal_config import Mode


def test_each_part_gets_its_own_steps() -> None:
    trace = {
        "clearance_m": np.array([0.1, 0.4, 0.6, 3.0]),
        "mode": np.array([Mode.AVOID, Mode.FOLLOW, Mode.FOLLOW, Mode.REPLAN], dtype=np.float64),
    }
    found = split_errors(trace, np.array([3.0, 4.0, 1.0, 7.0]), np.array([True, True, True, False]))
    assert found["position_rmse_narrow_m"] == pytest.approx(np.sqrt(12.5))
    assert found["position_rmse_open_m"] == 1.0
    assert found["position_rmse_reactive_m"] == 3.0
    assert found["position_rmse_following_m"] == pytest.approx(np.sqrt(8.5))


def test_a_part_without_steps_is_left_out() -> None:
    found = split_errors({"clearance_m": np.array([2.0])}, np.array([1.0]), np.array([True]))
    assert found == {"position_rmse_open_m": 1.0}
