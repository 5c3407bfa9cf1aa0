"""The SLAM benchmark's measure: errors of relations, their matching in time, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.relations import relation_errors, relation_nees
from pilotage.logs.relations import Relations, read_relations
from pilotage.logs.trajectories import read_tum, write_planar_tum

Capture = pytest.CaptureFixture[str]
T0_S = 976052857.337


def planar_motion(first: FloatArray, second: FloatArray) -> FloatArray:
    """``second`` (K, 3) as seen from ``first``."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    d = second - first
    return np.column_stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1], d[:, 2]])


def walk(seed: int, poses: int = 40) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    t_s = T0_S + np.cumsum(rng.uniform(0.05, 0.4, poses)).round(6)
    return t_s.round(6), rng.normal(size=(poses, 3)) * [5.0, 5.0, 2.0]


def relations_text(t_s: FloatArray, poses: FloatArray, i: list[int], j: list[int]) -> str:
    rows = zip(t_s[i], t_s[j], planar_motion(poses[i], poses[j]), strict=True)
    return "# true\n" + "".join(
        f"{a:.6f} {b:.6f} {m[0]:.9f} {m[1]:.9f} 0 0 0 {m[2]:.9f}\n" for a, b, m in rows
    )


def written(folder: Path, seed: int = 0) -> tuple[Path, Path, FloatArray, FloatArray]:
    t_s, poses = walk(seed)
    tum, relations = folder / "estimate.tum", folder / "true.relations"
    write_planar_tum(tum, t_s, poses)
    relations.write_text(relations_text(t_s, poses, [0, 3, 9], [5, 30, 2]))
    return tum, relations, t_s, poses


def test_the_truth_has_no_error(tmp_path: Path) -> None:
    tum, relations, _, _ = written(tmp_path)
    errors = relation_errors(read_tum(tum), read_relations(relations))
    assert errors.used.tolist() == [0, 1, 2]
    assert (errors.first.tolist(), errors.second.tolist()) == ([0, 3, 9], [5, 30, 2])
    assert max(errors.translation_m.max(), errors.rotation_rad.max()) < 1e-7


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_errors_are_those_of_the_motions_whatever_the_map_frame(seed: int) -> None:
    """Turning and shifting the whole estimate changes nothing; an added error is found again."""
    rng = np.random.default_rng(seed)
    t_s, poses = walk(seed)
    true = planar_motion(poses[:1], poses[1:2])
    error = rng.normal(0.0, 0.3, 3)
    given_motion = Relations(
        t_s[:1], t_s[1:2], np.array([[*(true - error)[0, :2], 0.0]]), np.array([[0, 0, (true - error)[0, 2]]])
    )
    angle = rng.uniform(-3, 3)
    c, s = np.cos(angle), np.sin(angle)
    shifted = poses @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [*rng.normal(size=2), angle]
    for estimate in (poses, shifted):
        found = relation_errors(_trajectory(t_s, estimate), given_motion)
        assert found.translation_m[0] == pytest.approx(np.hypot(*error[:2]), abs=1e-9)
        assert found.rotation_rad[0] == pytest.approx(abs(error[2]), abs=1e-7)
        np.testing.assert_allclose(found.planar[0], error, atol=1e-9)


def _trajectory(t_s: FloatArray, poses: FloatArray):  # type: ignore[no-untyped-def]
    from pilotage.logs.trajectories import Trajectory3

    c, s, z = np.cos(poses[:, 2]), np.sin(poses[:, 2]), np.zeros(len(poses))
    turns = np.array([[c, -s, z], [s, c, z], [z, z, z + 1]]).transpose(2, 0, 1)
    return Trajectory3(t_s, np.column_stack([poses[:, :2], z]), turns)


def test_a_relation_without_a_pose_is_counted(tmp_path: Path) -> None:
    tum, relations, t_s, poses = written(tmp_path)
    write_planar_tum(tum, t_s[:20], poses[:20])
    summary = relation_errors(read_tum(tum), read_relations(relations)).summary()
    assert (summary["relations"], summary["relations_without_pose"]) == (2, 1)
    shifted = read_relations(relations)
    later = Relations(
        shifted.first_s + 0.0012, shifted.second_s, shifted.points_xyz_m, shifted.roll_pitch_yaw_rad
    )
    with pytest.raises(InputError, match=r"within 0\.001 s of the relations' times, found none nearer"):
        relation_errors(read_tum(tum), later)
    assert relation_errors(read_tum(tum), later, 0.002).used.size == 2


def test_nees_of_true_covariances_is_three() -> None:
    rng = np.random.default_rng(0)
    t_s, poses = walk(1, 2)
    cov = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]])
    errors = rng.multivariate_normal(np.zeros(3), cov, 3000)
    true = planar_motion(poses[:1], poses[1:2]) - errors
    count = len(errors)
    relations = Relations(
        np.full(count, t_s[0]),
        np.full(count, t_s[1]),
        np.column_stack([true[:, :2], np.zeros(count)]),
        np.column_stack([np.zeros((count, 2)), true[:, 2]]),
    )
    found = relation_errors(_trajectory(t_s, poses), relations)
    nees = relation_nees(found, np.repeat(cov[None], count, axis=0))
    # Off by chance in 1 of 10^6.
    assert nees.mean() == pytest.approx(3.0, abs=4.9 * np.sqrt(6.0 / count))
    with pytest.raises(InputError, match="shape"):
        relation_nees(found, cov)
    with pytest.raises(InputError, match="singular"):
        relation_nees(found, np.zeros((count, 3, 3)))


def test_the_command(tmp_path: Path, capsys: Capture) -> None:
    tum, relations, _, _ = written(tmp_path)
    assert main(["evaluate", str(tum), str(relations), "--relations", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["relations"] == 3
    keys = {"trans_mean_m", "trans_std_m", "trans_max_m", "rot_mean_deg", "rot_std_deg"}
    assert max(answer[key] for key in keys) < 1e-5
    assert main(["evaluate", str(tum), str(relations), "--relations"]) == 0
    assert "trans_mean_m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--relations", "--align"], "without --align"),
        (["--relations", "--format", "kitti"], "without --align"),
        (["--relations", "--tolerance", "-1"], "--tolerance"),
        (["--tolerance", "1"], "together with --relations"),
    ],
)
def test_misuse_is_one_line(tmp_path: Path, capsys: Capture, words: list[str], told: str) -> None:
    tum, relations, _, _ = written(tmp_path)
    assert main(["evaluate", str(tum), str(relations), *words]) == 2
    line = capsys.readouterr().err.strip()
    assert told in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "line 1: expected rows of numbers"),
        ("1 2 3 4 5 6 7\n", "line 1: expected 8 columns"),
        ("1 2 3 4 5 6 7 8\n1 2 3 4 5 x 7 8\n", "line 2: roll: expected a number"),
        ("1 2 nan 4 5 6 7 8\n", "line 1: x: expected a finite number"),
        ("1 2 1e9 4 5 6 7 8\n", "line 1: x: expected a number within"),
    ],
)
def test_damaged_relations(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "r.relations"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_relations(path)
