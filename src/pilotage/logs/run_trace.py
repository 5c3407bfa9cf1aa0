"""Our own run folders as logs: the odometry readings of ``trace.parquet`` beside the true poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.parquet import read_parquet
from pilotage.core.types import FloatArray
from pilotage.logs.odometry_steps import OdometryForm, OdometrySteps, arc_ends

TRACE = "trace.parquet"
LARGEST = 1e9
"""Farther than any coordinate on earth, longer than any run."""
COLUMNS = ("t_s", "true_x_m", "true_y_m", "true_theta_rad", "odom_distance_m", "odom_angle_rad")
LATERAL = "odom_lateral_m"


def read_run_odometry(run_dir: Path) -> OdometrySteps:
    """Read a run folder's odometry increments; steps between readings are one.

    The first reading is left out, because the trace begins with the pose at its end.

    Raises
    ------
    InputError
        Where the folder holds no readable trace, or its odometry was not recorded.
    """
    columns = read_columns(run_dir / TRACE, COLUMNS, (LATERAL,))
    read = np.flatnonzero(np.isfinite(columns["odom_distance_m"]) & np.isfinite(columns["odom_angle_rad"]))
    if read.size < 3:
        raise InputError(f"{run_dir / TRACE}: expected odometry readings, found {read.size}")
    poses = np.column_stack([columns["true_x_m"], columns["true_y_m"], columns["true_theta_rad"]])
    lost = np.flatnonzero(~np.isfinite(poses).all(axis=1))
    if lost.size:
        raise InputError(f"{run_dir / TRACE} row {int(lost[0]) + 1}: expected a true pose, found none")
    start, truth = poses[read[:-1]], poses[read[1:]]
    lateral_m = np.nan_to_num(columns.get(LATERAL, np.zeros(len(poses))))
    claimed = arc_ends(
        start,
        columns["odom_distance_m"][read[1:]],
        columns["odom_angle_rad"][read[1:]],
        lateral_m[read[1:]],
    )
    return OdometrySteps(
        run_dir.resolve().name, OdometryForm.INCREMENTS, columns["t_s"][read[1:]], start, truth, claimed
    )


def read_columns(path: Path, names: tuple[str, ...], perhaps: tuple[str, ...] = ()) -> dict[str, FloatArray]:
    """Read columns of a parquet file as float arrays, those that are there perhaps only where they are.

    Raises
    ------
    InputError
        Where the file is missing, is no parquet file, lacks a column, its numbers are beyond all metres and
        seconds, or its times do not increase.
    """
    found = read_parquet(path, names, "a run folder's trace", perhaps=perhaps)
    columns = {}
    for name in found:
        if found[name].dtype.kind not in "iuf":
            raise InputError(f"{path}: {name}: expected numbers, found {found[name].dtype}")
        columns[name] = np.asarray(found[name], dtype=np.float64)
        with np.errstate(invalid="ignore"):
            far = np.flatnonzero(np.abs(columns[name]) > LARGEST)
        if far.size:
            raise InputError(
                f"{path} row {int(far[0]) + 1}: {name}: expected a number within {LARGEST:g}, "
                f"found {columns[name][far[0]]:g}"
            )
    wrong = np.flatnonzero(~(np.diff(columns["t_s"]) > 0.0))
    if wrong.size:
        raise InputError(f"{path} row {int(wrong[0]) + 2}: expected a time after that of the row before")
    return columns
