"""Trajectories in space as the TUM and KITTI benchmarks write them.

TUM: ``t x y z qx qy qz qw`` a line, seconds and metres, Hamilton quaternion with the scalar last.
KITTI: the upper three rows of the pose matrix, row by row, twelve numbers a line, no time.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.core.whole_file import write_whole
from pilotage.logs.text import check_size, check_times, read_lines, read_table

TUM_COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
KITTI_COLUMNS = tuple(f"{'rt'[c == 3]}{r + 1}{c + 1 if c < 3 else ''}" for r in range(3) for c in range(4))
LARGEST_M = 1e9
"""Farther than any coordinates on earth."""
ROTATION_TOLERANCE = 1e-2
"""A pose matrix whose rotation is farther from orthonormal than this is refused."""


class TrajectoryFormat(StrEnum):
    """How the file is written."""

    TUM = "tum"
    KITTI = "kitti"


FORM_OF = {len(TUM_COLUMNS): TrajectoryFormat.TUM, len(KITTI_COLUMNS): TrajectoryFormat.KITTI}


@dataclass(frozen=True, slots=True)
class Trajectory3:
    """A path in space.

    Attributes
    ----------
    t_s
        (N,) strictly increasing times; None where the format holds none.
    points_xyz_m
        (N, 3).
    rotations
        (N, 3, 3), body to world.
    """

    t_s: FloatArray | None
    points_xyz_m: FloatArray
    rotations: FloatArray

    def __len__(self) -> int:
        return int(self.points_xyz_m.shape[0])


def guess_format(path: Path) -> TrajectoryFormat:
    """Tell the format by the columns of the first line that has any.

    Raises
    ------
    InputError
        File and line where they are of neither.
    """
    _is_no_folder(path)
    lines = read_lines(path)
    for number, line in enumerate(lines, start=1):
        columns = len(line.partition("#")[0].split())
        if columns in FORM_OF:
            return FORM_OF[columns]
        if columns:
            raise InputError(
                f"{path} line {number}: expected 8 columns (TUM: t x y z qx qy qz qw) or 12 (KITTI), blanks "
                f"between them and no names above, found {columns}"
            )
    raise InputError(f"{path} line {len(lines) + 1}: expected poses, found the end of the file")


def read_trajectory(path: Path, form: TrajectoryFormat) -> Trajectory3:
    """Read a trajectory; InputError with file and line where it cannot be used."""
    _is_no_folder(path)
    return read_tum(path) if form is TrajectoryFormat.TUM else read_kitti(path)


def _is_no_folder(path: Path) -> None:
    if path.is_dir():
        there = "trajectory.tum" if (path / "trajectory.tum").is_file() else ""
        hint = (
            f"it holds {there}"
            if there
            else "of a run 'pilotage export RUN --to tum' writes its trajectories"
        )
        raise InputError(f"{path}: expected a trajectory's file, found a folder; {hint}")


def read_tum(path: Path) -> Trajectory3:
    """Read a TUM trajectory; quaternions are normalized (the files round them to four digits).

    Raises
    ------
    InputError
        File and line of what is missing, not finite, or out of the order of time.
    """
    table = read_table(path, TUM_COLUMNS)
    check_size(table, TUM_COLUMNS, most=LARGEST_M)
    t_s = table.values[:, 0].copy()
    check_times(table, t_s)
    norms = np.linalg.norm(table.values[:, 4:], axis=1)
    null = np.flatnonzero(norms < 1e-6)
    if null.size:
        raise InputError(f"{table.place(int(null[0]))}: expected a unit quaternion, found zeros")
    rotations = scipy.spatial.transform.Rotation.from_quat(table.values[:, 4:]).as_matrix()
    return Trajectory3(t_s, table.values[:, 1:4].copy(), np.asarray(rotations, dtype=np.float64))


def read_kitti(path: Path) -> Trajectory3:
    """Read a KITTI trajectory; the rotations are taken as they stand in the file.

    Raises
    ------
    InputError
        File and line of what is missing, not finite, or no rotation.
    """
    table = read_table(path, KITTI_COLUMNS)
    check_size(table, KITTI_COLUMNS, first=0, most=LARGEST_M)
    poses = table.values.reshape(-1, 3, 4)
    rotations = np.ascontiguousarray(poses[:, :, :3])
    off = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    bad = np.flatnonzero((off > ROTATION_TOLERANCE) | (np.linalg.det(rotations) < 0.0))
    if bad.size:
        raise InputError(f"{table.place(int(bad[0]))}: expected a rotation matrix in columns 1-3, 5-7, 9-11")
    return Trajectory3(None, np.ascontiguousarray(poses[:, :, 3]), rotations)


def write_planar_tum(path: Path, t_s: FloatArray, poses: FloatArray) -> None:
    """Write planar poses (N, 3) as a TUM trajectory; times to the microsecond, the rest to 9 digits.

    Raises
    ------
    OSError
        Where the file cannot be written.
    """
    half = 0.5 * poses[:, 2]
    rows = zip(t_s, poses[:, 0], poses[:, 1], np.sin(half), np.cos(half), strict=True)
    lines = [f"{t:.6f} {x:.9f} {y:.9f} 0 0 0 {s:.9f} {c:.9f}\n" for t, x, y, s, c in rows]
    write_whole(path, "".join(lines))
