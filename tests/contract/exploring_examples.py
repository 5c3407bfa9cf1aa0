"""What a navigator that explores a floor must do: the small room, seen and mapped, and back again."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.core.types import STOP, Pose2
from pilotage.maps.occupancy_grid import FREE, OccupancyGrid
from pilotage.stack.control.local.gap_horizon import GapHorizon
from pilotage.stack.control.local.gap_horizon_config import GapHorizonConfig
from pilotage.stack.interface import StackStatus
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.navigator.navigator import Parts
from support import worlds
from support.robots import sensors, told_of

START = Pose2(2.0, 2.0, 0.0)


def explores_the_floor(factory: Any, config: Any) -> None:
    """Two rooms and a door, by dead reckoning: both on the map, nothing touched, back at the start."""
    sim = worlds.alone(worlds.robot(sensors(), start=START))
    told = told_of(start=START, goal=None, variances=(0.0, 0.0, 0.0))
    reckoned = told.localizer(DeadReckoningLocalizer, DeadReckoningConfig())
    controller = GapHorizon(GapHorizonConfig(rollouts=64), np.random.default_rng(0))
    parts = Parts(reckoned, None, None, None, None, None, None, None, controller)
    navigator = told.navigator(factory, config, parts)
    units, command = dict(told.journal.units), STOP
    for _ in range(1500):
        command = navigator.step(sim.step(command))
        if navigator.status[0] is not StackStatus.RUNNING:
            break
    assert navigator.status[0] is StackStatus.ARRIVED, navigator.status
    assert told.journal.units == units
    assert sim.body.collisions == 0
    assert np.hypot(sim.truth.x_m - START.x_m, sim.truth.y_m - START.y_m) < 0.3
    grid = told.journal.results()["grid"]
    assert isinstance(grid, OccupancyGrid)
    places = np.array([[1.0, 1.0], [9.0, 1.0], [9.0, 7.0], [1.0, 7.0]])
    rows, columns = grid.cells_at(places).T
    assert (grid.cells[rows, columns] == FREE).all()
