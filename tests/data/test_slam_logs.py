"""The SLAM benchmark's bags: what they hold, and the errors of their raw odometry."""

from __future__ import annotations

from pathlib import Path

import pytest

from pilotage.evaluation.relations import relation_errors
from pilotage.logs.bags import read_bag
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum, write_planar_tum
from support.recordings import recording


@pytest.mark.parametrize(
    ("name", "scans", "beams", "readings", "relations", "odometry_m"),
    [
        ("intel", 13631, 180, 26915, 2984, 7.38),
        ("fr079", 4934, 360, 8951, 1685, 6.50),
        ("fr-clinic", 6917, 181, 6917, 2820, None),
    ],
)
def test_raw_odometry_against_the_relations(
    tmp_path: Path,
    name: str,
    scans: int,
    beams: int,
    readings: int,
    relations: int,
    odometry_m: float | None,
) -> None:
    pytest.importorskip("rosbags")
    log = read_bag(recording(f"slam/{name}.bag"))
    assert log.ranges_m.shape == (scans, beams)
    assert log.odometry is not None
    assert log.odometry.shape == (readings, 3)
    poses = log.odometry_at_scans()
    assert poses is not None
    write_planar_tum(tmp_path / "odometry.tum", log.t_s, poses)
    summary = relation_errors(
        read_tum(tmp_path / "odometry.tum"), read_relations(recording(f"slam/{name}.relations"))
    ).summary()
    assert (summary["relations"], summary["relations_without_pose"]) == (relations, 0)
    if odometry_m is not None:
        assert summary["trans_mean_m"] == pytest.approx(odometry_m, abs=0.005)


def test_a_bag_cut_in_half_is_read_to_its_end(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    path = recording("slam/fr079.bag")
    data = path.read_bytes()
    cut = tmp_path / "cut.bag"
    cut.write_bytes(data[: len(data) // 2])
    whole, half = read_bag(path), read_bag(cut)
    assert 0.35 * len(whole) < len(half) < 0.65 * len(whole)
    assert sum("cut short" in warning for warning in half.warnings) == 1
    assert half.t_s.tobytes() == whole.t_s[: len(half)].tobytes()
    assert half.ranges_m.tobytes() == whole.ranges_m[: len(half)].tobytes()
    assert half.mount == whole.mount
