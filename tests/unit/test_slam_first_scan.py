"""Localizer slam: what the robot drives before its first scan counts."""

from __future__ import annotations

import numpy as np

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

CHANGES = (
    "world.goal=null",
    "task=drive",
    "stack.map=none",
    "stack.initial={x_var_m2: 0.0, y_var_m2: 0.0, theta_var_rad2: 0.0}",
    "stack.localizer={name: slam}",
    "stack.planner=null",
    "stack.navigator={name: open-loop, speed_m_s: 0.2, turn_rate_rad_s: 1.0, duration_s: 3}",
    "robot.sensors.lidar.rate_hz=2",
)


def test_the_map_begins_where_the_first_scan_was_taken() -> None:
    """Half a second into a turn it was laid at the start's heading: 0.4 rad off for good, and sure of it."""
    trace = simulate(load_mission("museum-1", CHANGES, 0)).finished.robots[0].trace
    off = np.remainder(trace["est_theta_rad"] - trace["true_theta_rad"] + np.pi, 2.0 * np.pi) - np.pi
    away_m = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
    assert np.abs(off).max() < 0.02
    assert away_m.max() < 0.03
    assert abs(trace["true_theta_rad"][-1] - trace["true_theta_rad"][0]) > 0.5
