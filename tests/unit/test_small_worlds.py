"""Worlds of a metre: a robot knows where it is there as it does in large ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.errors import InputError
from pilotage.maps.grid_image import write_grey

SIDE_M = 0.005


def map_file(folder: Path) -> str:
    """A room of 1.6 m x 1.1 m with walls of 1.5 cm in it."""
    boxes = [(0.5, 0.0, 0.515, 0.4), (0.5, 0.55, 0.515, 1.1), (1.0, 0.0, 1.015, 0.55), (0.7, 0.2, 0.75, 0.25)]
    grey = np.full((220, 320), 254, np.uint8)
    grey[:2] = grey[-2:] = grey[:, :2] = grey[:, -2:] = 0
    for box in boxes:
        x0, y0, x1, y1 = (round(side / SIDE_M) for side in box)
        grey[220 - y1 : 220 - y0, x0:x1] = 0
    write_grey(folder / "small.pgm", grey)
    (folder / "small.yaml").write_text(f"image: small.pgm\nresolution: {SIDE_M}\norigin: [0, 0, 0]\n")
    return str(folder / "small.yaml")


def test_a_particle_filter_is_not_sure_of_what_is_wrong(tmp_path: Path) -> None:
    """Nodes 5 cm apart knew another cell for the nearest: off by 5 std, and said to be localized."""
    mission = {
        "mission": "small",
        "world": {"map": map_file(tmp_path), "start": {"x_m": 0.25, "y_m": 0.3, "theta_rad": 1.0}},
        "robot": {
            "footprint": {"radius_m": 0.02},
            "sensors": {
                "odometry": {"name": "wheel-odometry", "rate_hz": 10},
                "lidar": {"name": "lidar", "beams": 360, "field_of_view_rad": 6.28, "max_range_m": 0.8},
            },
        },
        "task": {"name": "localize", "tolerance_m": 0.02},
        "stack": {
            "navigator": {"name": "open-loop", "speed_m_s": 0.05, "turn_rate_rad_s": 0.6, "duration_s": 12.0},
            "localizer": "particle-filter",
            "initial": {"x_var_m2": 1e-6, "y_var_m2": 1e-6, "theta_var_rad2": 1e-3},
        },
    }
    run = pl.run(mission, save=False, progress=False)
    assert run.success, run.reason
    assert run.metrics["nees_mean"] < 6.0
    assert run.metrics["position_rmse_m"] < 0.003


def fenced(navigator: str, localizer: str, task: object, goal: object) -> dict[str, object]:
    """A robot between posts that all but touch, with three trees inside; nothing there is straight."""
    side = [[0.3 * k, y, 0.15] for k in range(18) for y in (0.0, 4.2)]
    posts = side + [[x, 0.3 * k, 0.15] for k in range(1, 14) for x in (0.0, 5.1)]
    trees = [[1.6, 2.8, 0.2], [2.6, 1.3, 0.3], [3.9, 3.0, 0.15]]
    start = {"x_m": 0.9, "y_m": 0.9, "theta_rad": 0.5}
    return {
        "extends": "museum-unknown",
        "world": {
            "map": {"map": "fenced", "walls_m": [], "circles_m": posts + trees},
            "start": start,
            "goal": goal,
            "random_start": None,
        },
        "robot": {"footprint": {"radius_m": 0.2}},
        "task": task,
        "stack": {"navigator": navigator, "localizer": localizer, "map": "none" if goal is None else "given"},
    }


def test_a_floor_of_discs_alone_is_known_by_laser() -> None:
    """Localizer laser took the filter on straight walls, which refused in its own name."""
    mission = fenced("local", "laser", "reach", {"x_m": 4.4, "y_m": 2.0})
    run = pl.run(mission, save=False, progress=False)
    assert run.success, run.reason
    assert run.metrics["position_rmse_m"] < 0.02
    with pytest.raises(
        InputError, match=r"ekf-walls: expected walls that are straight .* particle-filter among discs"
    ):
        pl.run(fenced("local", "ekf-walls", "reach", {"x_m": 4.4, "y_m": 2.0}), save=False, progress=False)


def test_a_floor_of_discs_alone_may_be_explored() -> None:
    """It was refused as a floor without walls."""
    mission = fenced("floor-frontier", "slam", "explore", None) | {"run": {"time_limit_s": 4.0}}
    run = pl.run(mission, save=False, progress=False)
    assert run.metrics["floor_mapped"] > 0.7
