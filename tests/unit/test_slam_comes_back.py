"""Loops that are closed between two steps: the localizer is where they put it at once."""

from __future__ import annotations

import pytest

from pilotage.core.types import Pose2, Twist
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.localization.slam import SlamLocalizer
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.online import OnlineSlam
from support.robots import sensors, told_of
from support.worlds import ROOM_MAP, robot


def test_a_localizer_that_looks_for_loops_is_where_they_put_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who came home closed the loop, looked where it was before, and said that it was back."""
    told = told_of(start=Pose2(2.0, 2.0, 0.0), variances=(0.0, 0.0, 0.0))
    localizer = told.localizer(SlamLocalizer, SlamConfig())
    sim = Simulator(World.of(ROOM_MAP), [robot(sensors(), start=told.initial.pose)], told.robot.dt_s)
    before = [localizer.step(sim.step([Twist(0.3, 0.0)])[0]) for _ in range(40)][-1]

    def moved(slam: OnlineSlam, ended: bool = False) -> int:
        slam.keyframe_poses = slam.keyframe_poses - [0.1, 0.0, 0.0]
        return 1 + ended

    monkeypatch.setattr(OnlineSlam, "close", moved)
    assert localizer.close_loops() == 2
    assert localizer.belief.pose.x_m == pytest.approx(before.pose.x_m - 0.1)
