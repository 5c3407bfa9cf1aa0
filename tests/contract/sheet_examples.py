"""Examples of what an exploring robot carries and runs: sensors on a sheet, explorers."""

from __future__ import annotations

from typing import Any

import numpy as np

from contract.numbers_of_sensors import tells_its_numbers
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, WheelSpeeds
from pilotage.evaluation.sheet_visits import VisitedCells
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.stack.interface import StackStatus
from support.sheets import DT_S, SHEET, ToldOfSheet, sheet_sensors, sheet_simulator


def sheet_sensor_reads(_: Any, config: Any) -> None:
    """The same sheet and the same seed give the same readings, and some."""
    carried = {**sheet_sensors(), "it": config}
    if type(config).__name__ in {"WheelEncodersConfig", "GyroscopeConfig"}:
        carried = {
            name: other for name, other in sheet_sensors().items() if type(other) is not type(config)
        } | {"it": config}
    series = []
    for _attempt in range(2):
        sim = sheet_simulator(carried, RandomStreams(1))
        readings = [sim.step(WheelSpeeds(2.0, 1.5)).by_sensor.get("it") for _ in range(40)]
        series.append([repr(reading) for reading in readings])
        tells_its_numbers(config, readings, DT_S, WheelDriveConfig())
    assert series[0] == series[1]
    assert any(reading != "None" for reading in series[0])


def explorer_explores(factory: Any, config: Any) -> None:
    """Two minutes on a small sheet: commands within limits, cells visited, a belief near the truth."""
    told = ToldOfSheet()
    sim = sheet_simulator(sheet_sensors(), RandomStreams(2))
    explorer = told.explorer(factory, config)
    units = dict(told.journal.units)
    assert units, "an explorer tells something at every step"
    visits = VisitedCells(SHEET.size_m, SHEET.cells)
    command = WheelSpeeds(0.0, 0.0)
    for _ in range(12_000):
        readings = sim.step(command)
        if not sim.on_sheet:
            break
        visits.add(sim.truth.x_m, sim.truth.y_m, sim.t_s)
        command = explorer.step(readings)
        assert np.isfinite([command.left_rad_s, command.right_rad_s]).all()
        status, reason = explorer.status
        if status is not StackStatus.RUNNING:
            assert reason
            break
    assert told.journal.units == units
    assert np.isfinite(told.journal.row).any()
    assert visits.count > 5
    assert explorer.cells.shape == explorer.visited.shape == SHEET.cells[::-1]
    assert int(explorer.visited.sum()) > 3
    offered = told.journal.results()
    assert offered.keys() >= {"cells", "visited", "left"}
    assert offered["visited"] is explorer.visited or np.array_equal(offered["visited"], explorer.visited)  # type: ignore[arg-type]
    pose: Pose2 = explorer.belief.pose
    assert np.hypot(pose.x_m - sim.truth.x_m, pose.y_m - sim.truth.y_m) < 0.5
    assert np.linalg.eigvalsh(explorer.belief.cov).min() > 0.0
