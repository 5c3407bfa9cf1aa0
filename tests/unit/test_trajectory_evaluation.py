"""Trajectory errors: known answers, invariances, association, alignment, and files that are wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.trajectory import associate, trajectory_errors, umeyama
from pilotage.logs.trajectories import (
    Trajectory3,
    TrajectoryFormat,
    guess_format,
    read_kitti,
    read_trajectory,
    read_tum,
)


def wander(n: int = 60, seed: int = 0, t_s: FloatArray | None = None) -> Trajectory3:
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(rng.normal(0.0, 0.3, (n, 3))).as_matrix()
    return Trajectory3(t_s, rng.normal(0.0, 2.0, (n, 3)), np.asarray(turns))


def moved(path: Trajectory3, turn: FloatArray, shift: FloatArray, scale: float = 1.0) -> Trajectory3:
    R = np.asarray(Rotation.from_rotvec(turn).as_matrix())
    return Trajectory3(path.t_s, scale * path.points_xyz_m @ R.T + shift, R @ path.rotations)


def test_equal_trajectories_have_no_error() -> None:
    path = wander()
    errors = trajectory_errors(path, path)
    assert errors.ate_m.max() == 0.0
    assert errors.rpe_m.max() == 0.0


def test_a_constant_shift_is_an_absolute_but_no_relative_error() -> None:
    path = wander()
    errors = trajectory_errors(moved(path, np.zeros(3), np.array([3.0, 4.0, 0.0])), path)
    np.testing.assert_allclose(errors.ate_m, 5.0)
    assert errors.rpe_m.max() < 1e-12
    assert errors.summary()["ate_rmse_m"] == pytest.approx(5.0)


@given(st.integers(0, 10_000), st.floats(0.2, 5.0))
def test_alignment_undoes_any_similarity(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    path = wander(20, seed)
    estimate = moved(path, rng.normal(size=3), rng.normal(size=3), scale)
    errors = trajectory_errors(estimate, path, align=True, scale=True)
    assert errors.ate_m.max() < 1e-9
    assert errors.rpe_m.max() < 1e-9
    assert errors.alignment.scale == pytest.approx(1.0 / scale)


def test_a_mirrored_cloud_is_aligned_by_a_rotation_not_by_a_mirror() -> None:
    points = np.random.default_rng(1).normal(size=(30, 3))
    fitted = umeyama(points * [1.0, 1.0, -1.0], points, with_scale=True)
    assert np.linalg.det(fitted.rotation) == pytest.approx(1.0)


def test_alignment_of_a_straight_line_is_refused() -> None:
    line = np.outer(np.linspace(0.0, 1.0, 10), [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="span a plane"):
        umeyama(line, line, with_scale=False)


def test_association_takes_the_nearest_time_and_leaves_out_what_is_too_far() -> None:
    few, many = np.array([0.0, 1.0, 2.0]), np.array([0.004, 0.009, 0.5, 0.995, 1.002, 2.02])
    first, second = associate(few, many)
    np.testing.assert_array_equal(first, [0, 1])
    np.testing.assert_array_equal(second, [0, 4])
    swapped = associate(many, few)
    np.testing.assert_array_equal(swapped[0], second)
    np.testing.assert_array_equal(swapped[1], first)


def test_of_two_equally_near_times_the_earlier_counts() -> None:
    np.testing.assert_array_equal(associate(np.array([0.0625]), np.array([0.0, 0.125]), 1.0)[1], [0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 nan 1\n", "line 2: qz: expected a finite number"),
        ("0 0 0 0 0 0 0 1\n1 0 0 0 0 0\n", "line 2: expected 8 columns .* found 6; the file seems to be cut"),
        ("0 0 0 0 0 0 0 1\n\n# no\n0 0 0 0 0 0 0 1\n", "line 4: .* found the same time again"),
        ("5 0 0 0 0 0 0 1\n4 0 0 0 0 0 0 1\n", "line 2: .* found a time before it"),
        ("0 0 0 zero 0 0 0 1\n", "line 1: z: expected a number, found 'zero'"),
        ("0 0 0 0 0 0 0 0\n", "line 1: expected a unit quaternion"),
        ("# nothing\n", "line 2: expected rows of numbers"),
    ],
)
def test_bad_tum_files_are_named_with_their_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_tum(path)


def test_a_runs_folder_is_told_where_its_trajectory_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"found a folder; .*pilotage export RUN --to tum"):
        guess_format(tmp_path)
    (tmp_path / "trajectory.tum").write_text("")
    with pytest.raises(InputError, match=r"found a folder; it holds trajectory\.tum"):
        read_trajectory(tmp_path, TrajectoryFormat.KITTI)


def test_kitti_rows_are_pose_matrices(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("0 -1 0 7 1 0 0 8 0 0 1 9\n")
    trajectory = read_kitti(path)
    np.testing.assert_array_equal(trajectory.points_xyz_m, [[7.0, 8.0, 9.0]])
    np.testing.assert_array_equal(trajectory.rotations[0] @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    path.write_text("0 -1 0 7 1 0 0 8 0 0 2 9\n")
    with pytest.raises(InputError, match="line 1: expected a rotation matrix"):
        read_kitti(path)


def test_the_command_prints_one_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [f"{i} {i} {i * i} 0 0 0 0 1" for i in range(5)]
    (tmp_path / "a.txt").write_text("\n".join(lines) + "\n")
    (tmp_path / "b.txt").write_text(
        "\n".join(line.replace(" 0 0 0 0 1", " 2 0 0 0 1") for line in lines) + "\n"
    )
    assert main(["evaluate", str(tmp_path / "a.txt"), str(tmp_path / "b.txt"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ate_rmse_m"] == 2.0
    assert answer["rpe_rmse_m"] == 0.0
    assert answer["format"] == "tum"


def test_the_command_refuses_what_it_cannot_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = str(tmp_path / "none.txt")
    assert main(["evaluate", missing, missing, "--format", "tum"]) == 2
    assert "none.txt: expected a readable file" in capsys.readouterr().err
    assert main(["evaluate", missing, missing, "--format", "tmu"]) == 2
    assert "did you mean 'tum'?" in capsys.readouterr().err
