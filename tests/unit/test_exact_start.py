"""A robot that knows exactly where it begins: every localizer takes it."""

from typing import Any

import pytest

import pilotage as pl
from pilotage.stack.localization.localizer import LOCALIZERS

SENSORS: dict[str, Any] = {
    "odometry": {"name": "wheel-odometry"},
    "lidar": {"name": "lidar", "beams": 180},
    "beacons": {"name": "beacons"},
    "gps": {"name": "gps"},
    "compass": {"name": "compass"},
}
NAMES = [entry.name for entry in LOCALIZERS]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("noise", [1.0, 0.0])
def test_it_drives_from_an_exact_start(name: str, noise: float) -> None:
    """The covariance of such a start has no inverse."""
    odometry = {
        "name": "wheel-odometry",
        "distance_var_m2_per_m": noise * 1e-4,
        "angle_var_rad2_per_rad": noise * 1e-4,
        "angle_var_rad2_per_m": noise * 1e-4,
    }
    mission = {
        "mission": "exact",
        "world": {"map": "museum", "start": {"x_m": 3.0, "y_m": 20.0}},
        "robot": {"sensors": SENSORS | {"odometry": odometry}},
        "task": "drive",
        "stack": {
            "navigator": {"name": "open-loop", "speed_m_s": 0.4, "turn_rate_rad_s": 0.1, "duration_s": 3.0},
            "localizer": name,
            "initial": {"x_var_m2": 0.01, "y_var_m2": 0.0, "theta_var_rad2": 0.0},
        },
    }
    run = pl.run(mission, save=False, progress=False)
    assert run.success, run.reason
