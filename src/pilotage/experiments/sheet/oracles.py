"""Oracles on a sheet: what a module would do if it knew the truth, to find out what the real one costs.

They live outside the stack. An exploring robot is one component, so they come in by three doors: the
simulator (``sensors``, ``drive``), what the explorer is given (``localizer``, ``mapper``; it says in
``TAKES`` what it takes), and the explorer's own place (``explorer``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import Pose2
from pilotage.maps.true_cells import SheetFile, true_map
from pilotage.missions.sheet import DriveErrorsConfig, SheetMission, WheelDriveConfig
from pilotage.sim.sheet_simulator import SheetSimulator
from pilotage.sim.sheet_world import SheetWorld
from pilotage.stack.exploration.explorer import EXPLORERS
from pilotage.stack.knowledge import FloorPlan, Given

ORACLES: Mapping[str, str] = {
    "sensors": "gyroscope, beams, line sensors and magnetometer without noise, bias, scale error or iron",
    "drive": "wheels that do what the data sheet says, at once: alike, without slip, without lag",
    "localizer": "the true pose instead of an estimate",
    "mapper": "boxes and tapes are on the robot's own map from the start",
    "explorer": "the whole robot knows: a short way through every reachable cell, driven from the true pose",
}
"""What stands in for each module."""
DOORS = {"localizer": "pose", "mapper": "plan"}
"""What an explorer has to take for an oracle to reach it."""


@dataclass(slots=True)
class Truth:
    """What the oracles know; the simulator steps meanwhile."""

    sheet: SheetFile
    world: SheetWorld
    simulator: SheetSimulator

    def pose(self) -> Pose2:
        """Where the robot is."""
        return self.simulator.truth


def applicable(mission: SheetMission) -> dict[str, str]:
    """The oracles that can stand in for something in a mission; InputError for an unknown explorer."""
    taken: frozenset[str] = getattr(
        EXPLORERS.entry(mission.stack.explorer.name).factory, "TAKES", frozenset()
    )
    return {name: text for name, text in ORACLES.items() if name not in DOORS or DOORS[name] in taken}


def given(oracles: frozenset[str], truth: Truth) -> Given:
    """What the explorer need not find out by itself."""
    return Given(
        pose=truth.pose if "localizer" in oracles else None,
        plan=floor_plan(truth) if "mapper" in oracles else None,
    )


def floor_plan(truth: Truth) -> FloorPlan:
    """What stands on the sheet, as a robot would have it on its own map."""
    faces = [
        side
        for x0, y0, x1, y1 in truth.world.boxes_m.tolist()
        for side in ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0))
    ]
    return FloorPlan(true_map(truth.sheet).cells, np.array(faces, dtype=np.float64).reshape(-1, 4))


def faithful(
    motion: WheelDriveConfig, errors: DriveErrorsConfig
) -> tuple[WheelDriveConfig, DriveErrorsConfig]:
    """A drive that is what its data sheet says; its random slip is drawn and comes to nothing."""
    exact = {
        "radius_difference": 0.0,
        "separation_error": (0.0, 0.0),
        "slip": (0.0, 0.0),
        "slip_std_m_sqrt_m": 0.0,
    }
    return motion.model_copy(update={"motor_lag_s": 0.0}), errors.model_copy(update=exact)
