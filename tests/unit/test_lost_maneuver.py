"""Navigator maneuver, once it does not know any more where it is."""

from __future__ import annotations

import pytest

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

PLANS = (
    "stack.navigator={name: maneuver}",
    "stack.planner={name: theta-star, clearance_m: 0.4}",
    *(
        f"stack.{part}=null"
        for part in ("smoother", "local_planner", "controller", "reactive", "mapper", "escape")
    ),
    "world.kidnaps=[{at_s: 10.0, clearance_m: 0.6}]",
)


@pytest.mark.parametrize("localizer", ["ekf-walls", "particle-filter"])
def test_who_is_carried_away_finds_itself_and_arrives(localizer: str) -> None:
    """It stood for the rest of its run: whoever stands sees nothing new."""
    changes = (*PLANS, f"stack.localizer={{name: {localizer}}}", "run.time_limit_s=300")
    finished = simulate(load_mission("museum-kidnap", changes, 0)).finished
    (robot,) = finished.robots
    assert robot.arrived, robot.reason
    assert not robot.collisions
    kinds = [event.kind for event in finished.events]
    assert kinds.index("lost") < kinds.index("found")
