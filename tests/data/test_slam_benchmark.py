"""The benchmark's recordings: relation errors and their consistency within the bars of the issue."""

from __future__ import annotations

from pathlib import Path

import pytest

import pilotage as pl
from pilotage.evaluation.relations import relation_errors
from pilotage.evaluation.slam_consistency import nees_summary
from pilotage.experiments.slam import slam_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum
from pilotage.stack.mapping.slam.config import SlamConfig
from support.recordings import recording

pytest.importorskip("rosbags")


# Stretches that lost the robot: odometry without a sign of who reverses, and stamped in bursts.
@pytest.mark.parametrize(
    ("name", "most_m", "stretch_s"), [("fr079", 0.045, (170.0, 215.0)), ("intel", 0.025, (20.0, 80.0))]
)
def test_relations_and_the_way_found_in_the_map(
    name: str, most_m: float, stretch_s: tuple[float, float], tmp_path: Path
) -> None:
    run = slam_log(recording(f"slam/{name}.bag"), tmp_path, SlamConfig())
    assert run.run_dir is not None
    trajectory = run.run_dir / "trajectory.tum"
    errors = relation_errors(read_tum(trajectory), read_relations(recording(f"slam/{name}.relations")))
    found = errors.summary()
    assert found["relations"] == errors.relations
    assert found["trans_mean_m"] <= most_m
    assert 1.5 <= nees_summary(errors, trajectory)["nees_mean"] <= 6.0
    found_again = pl.localize(
        recording(f"slam/{name}.bag"),
        map=run.run_dir / "map.yaml",
        truth=trajectory,
        from_s=stretch_s[0],
        to_s=stretch_s[1],
        out=tmp_path,
    )
    assert found_again.metrics["position_rmse_m"] < 0.1
    assert found_again.metrics["localized_share"] > 0.7
    assert found_again.metrics["silently_wrong_s"] < 1.0
