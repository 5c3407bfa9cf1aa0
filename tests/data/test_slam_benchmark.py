"""The benchmark's recordings: relation errors and their consistency within the bars of the issue."""

from __future__ import annotations

from pathlib import Path

import pytest

from pilotage.evaluation.relations import relation_errors
from pilotage.evaluation.slam_consistency import nees_summary
from pilotage.experiments.slam import slam_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum
from pilotage.stack.mapping.slam.config import SlamConfig
from support.recordings import recording

pytest.importorskip("rosbags")


@pytest.mark.parametrize(("name", "most_m"), [("fr079", 0.045), ("intel", 0.025)])
def test_relations(name: str, most_m: float, tmp_path: Path) -> None:
    run = slam_log(recording(f"slam/{name}.bag"), tmp_path, SlamConfig())
    assert run.run_dir is not None
    trajectory = run.run_dir / "trajectory.tum"
    errors = relation_errors(read_tum(trajectory), read_relations(recording(f"slam/{name}.relations")))
    found = errors.summary()
    assert found["relations"] == errors.relations
    assert found["trans_mean_m"] <= most_m
    assert 1.5 <= nees_summary(errors, trajectory)["nees_mean"] <= 6.0
