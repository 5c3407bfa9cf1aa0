"""Tracks of slam that broke are joined where the odometry says that they may be."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import mission_of

ALIKE: dict[str, Any] = {
    "mission": "twin-rooms",
    "world": {
        "map": {
            "map": "twin-rooms",
            "bounds_m": [0, 0, 11.12, 7.85],
            "walls_m": [
                [0, 0, 11.12, 0],
                [11.12, 0, 11.12, 7.85],
                [11.12, 7.85, 0, 7.85],
                [0, 7.85, 0, 0],
                [5.83, 0, 5.83, 3.45],
                [5.83, 4.66, 5.83, 7.85],
            ],
            "circles_m": [[4.41, 6.35, 0.16], [1.53, 1.71, 0.24], [2.33, 2.07, 0.18]],
        },
        "start": {"x_m": 2.625, "y_m": 3.425, "theta_rad": 2.93},
    },
    "robot": {
        "footprint": {"radius_m": 0.182},
        "motion": {
            "name": "omnidirectional",
            "max_speed_m_s": 0.76,
            "max_lateral_m_s": 0.76,
            "delay_s": 0.1,
        },
        "sensors": {
            "odometry": {"name": "wheel-odometry", "rate_hz": 5},
            "lidar": {
                "name": "lidar",
                "rate_hz": 10,
                "beams": 91,
                "field_of_view_rad": 6.2831,
                "max_range_m": 4.0,
                "range_var_m2": 1e-6,
            },
        },
    },
    "task": "explore",
    "stack": {
        "initial": {"x_var_m2": 0, "y_var_m2": 0, "theta_var_rad2": 0},
        "map": "none",
        "navigator": "floor-frontier",
        "localizer": "slam",
        "local_controller": "mppi",
    },
    "run": {"dt_s": 0.1, "time_limit_s": 30, "seed": 1268},
}
"""Two rooms and the door between them, which looks alike from both its sides."""


def test_a_door_that_looks_alike_from_both_sides_turns_nobody_around() -> None:
    """The track broke in the door and was joined half a turn off, which the odometry had contradicted."""
    trace = simulate(mission_of(ALIKE)).finished.robots[0].trace
    turned = np.remainder(trace["est_theta_rad"] - trace["true_theta_rad"] + np.pi, 2.0 * np.pi) - np.pi
    away_m = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
    assert trace["true_x_m"].max() > 6.5, "came through the door"
    assert np.abs(turned).max() < 0.1
    assert away_m.max() < 0.2
