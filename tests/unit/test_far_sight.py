"""Scanners that see farther than the report's: what they see there is used."""

from __future__ import annotations

import pytest

import pilotage as pl
from pilotage.sensors.lidar import LidarConfig

HALL = [[0, 0, 110, 0], [110, 0, 110, 90], [110, 90, 0, 90], [0, 90, 0, 0]]


@pytest.mark.parametrize("localizer", ["particle-filter", "ekf-walls"])
def test_walls_beyond_twenty_metres_localize(localizer: str) -> None:
    """Readings beyond 19.9 m were left out, whatever the scanner: it dead-reckoned for ever."""
    mission = {
        "mission": "far-sight",
        "world": {"map": {"map": "hall", "walls_m": HALL}, "start": {"x_m": 50.0, "y_m": 42.0}},
        "robot": {
            "sensors": {
                "odometry": {"name": "wheel-odometry", "rate_hz": 10},
                "lidar": {"name": "lidar", "beams": 720, "max_range_m": 80.0},
            }
        },
        "task": {"name": "localize", "tolerance_m": 0.1},
        "stack": {
            "navigator": {"name": "open-loop", "speed_m_s": 0.8, "turn_rate_rad_s": 0.1, "duration_s": 15.0},
            "localizer": localizer,
        },
    }
    run = pl.run(mission, save=False, progress=False)
    assert run.success, run.reason
    assert float(run.trace["cov_xx_m2"][-1] + run.trace["cov_yy_m2"][-1]) < 0.05**2


def test_of_the_reports_scanner_as_much_is_used_as_the_report_uses() -> None:
    assert LidarConfig().sure_range_m == 19.9
