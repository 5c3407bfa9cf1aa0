"""Two rooms with doors between them, and a robot that fails in one: what stands is planned around."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.stack.patrol.roadmap import Roadmap

DOOR_Y_M = 1.0


def two_rooms(*doors_y_m: float, wall_x_m: float = 5.0) -> dict[str, Any]:
    """Two rooms, 6 m deep, with doors of 1 m between them; a robot fails in the one at the bottom."""
    ends = [0.0, *(end for y in doors_y_m for end in (y - 0.5, y + 0.5)), 6.0]
    walls: list[list[float]] = [[0, 0, 10, 0], [10, 0, 10, 6], [10, 6, 0, 6], [0, 6, 0, 0]]
    walls += [[wall_x_m, low, wall_x_m, high] for low, high in zip(ends[::2], ends[1::2], strict=True)]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "two rooms", "bounds_m": [0, 0, 10, 6], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": 120.0, "derive": {"reach_m": 3.0}}
    values["robots"] = [
        {"start": {"x_m": wall_x_m, "y_m": DOOR_Y_M, "theta_rad": 0.0}},
        {"start": {"x_m": 2.0, "y_m": 3.0, "theta_rad": 0.0}},
        {"start": {"x_m": 1.0, "y_m": 5.0, "theta_rad": 0.0}},
    ]
    values["team"] = {
        "strategy": "cyclic",
        "radio": {},
        "failures": [{"robot": 0, "at_s": 0.0}],
    }
    values["run"]["time_limit_s"] = 120.0
    return values


def roadmap_of(*doors_y_m: float) -> Roadmap:
    stack: Any = build(mission_of(two_rooms(*doors_y_m), seed=0)).team[1].stack
    found = stack._context.roadmap
    assert isinstance(found, Roadmap)
    return found


def discs(middles_xy_m: FloatArray, radius_m: float) -> FloatArray:
    return np.insert(middles_xy_m, 2, radius_m, axis=1)
