"""A scanner that reaches no farther than where the robot looks for others: what it does not see is nobody."""

from __future__ import annotations

import pytest

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

HALL = (
    "world.map={map: hall, bounds_m: [0, 0, 24, 16], "
    "walls_m: [[0, 0, 24, 0], [24, 0, 24, 16], [24, 16, 0, 16], [0, 16, 0, 0]]}"
)


@pytest.mark.parametrize("reach_m", [3.0, 7.5, 20.0])
def test_beams_that_meet_nothing_are_of_nobody(reach_m: float) -> None:
    """Where the reach is less than 8 m their ends were: somebody came on all around, 274 alarms in 240 s."""
    mission = load_mission(
        "museum-patrol",
        (
            HALL,
            "team.size=1",
            f"robot.sensors.lidar.max_range_m={reach_m}",
            "task.duration_s=8",
            "run.time_limit_s=8",
        ),
        5,
    )
    finished = simulate(mission).finished
    assert finished.robots[0].counts["alarms"] == 0
    assert finished.robots[0].driven_m > 3.0
