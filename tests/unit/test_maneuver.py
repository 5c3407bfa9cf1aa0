"""A car that parks: the shipped mission, over three seeds, ends in its bay and touches nothing."""

from __future__ import annotations

import pytest

from pilotage.core.errors import InputError
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.stack.navigator.maneuver import ManeuverConfig, ManeuverNavigator
from pilotage.stack.navigator.navigator import Parts
from support.robots import told_of


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_parks(seed: int) -> None:
    metrics = run_mission(load_mission("car-park", seed=seed), save=False).metrics
    assert metrics["success"], metrics["reason"]
    assert metrics["collisions"] == 0
    assert float(str(metrics["goal_error_m"])) <= 0.15
    assert float(str(metrics["min_clearance_m"])) > 0.0


def test_what_it_lacks_is_said() -> None:
    told = told_of()
    parts = Parts(None, None, None, None, None, None, None, None)
    with pytest.raises(InputError, match=r"stack\.planner"):
        told.navigator(ManeuverNavigator, ManeuverConfig(), parts)
