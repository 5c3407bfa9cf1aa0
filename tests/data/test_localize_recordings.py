"""The filter on real robots, each with parameters learned from the other four."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.experiments.recordings.localize import localize_log
from support.recordings import recording


def test_mrclam_robots_are_found(tmp_path: Path) -> None:
    folder = recording("mrclam/MRCLAM_Dataset6")
    errors, normalized = [], []
    for robot in range(1, 6):
        found = localize_log(folder, tmp_path, form="mrclam", robot=robot).metrics
        assert f"MRCLAM_Dataset6 robot {robot}" not in str(found["learned_from"])
        assert found["success"]
        errors.append(float(str(found["position_rmse_m"])))
        normalized.append(float(str(found["nees_mean"])))
    assert max(errors) <= 0.17
    assert np.mean(errors) <= 0.13
    assert all(1.5 <= value <= 6.0 for value in normalized)
