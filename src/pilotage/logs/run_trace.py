"""Our own run folders as logs: the odometry readings of ``trace.parquet`` beside the true poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.odometry_steps import OdometryForm, OdometrySteps, arc_ends

TRACE = "trace.parquet"
COLUMNS = ("t_s", "true_x_m", "true_y_m", "true_theta_rad", "odom_distance_m", "odom_angle_rad")


def read_run_odometry(run_dir: Path) -> OdometrySteps:
    """Read a run folder's odometry increments; steps between readings are one.

    The first reading is left out, because the trace begins with the pose at its end.

    Raises
    ------
    InputError
        Where the folder holds no readable trace, or its odometry was not recorded.
    """
    columns = read_columns(run_dir / TRACE, COLUMNS)
    read = np.flatnonzero(np.isfinite(columns["odom_distance_m"]) & np.isfinite(columns["odom_angle_rad"]))
    if read.size < 3:
        raise InputError(f"{run_dir / TRACE}: expected odometry readings, found {read.size}")
    poses = np.column_stack([columns["true_x_m"], columns["true_y_m"], columns["true_theta_rad"]])
    lost = np.flatnonzero(~np.isfinite(poses).all(axis=1))
    if lost.size:
        raise InputError(f"{run_dir / TRACE} row {int(lost[0]) + 1}: expected a true pose, found none")
    start, truth = poses[read[:-1]], poses[read[1:]]
    claimed = arc_ends(start, columns["odom_distance_m"][read[1:]], columns["odom_angle_rad"][read[1:]])
    return OdometrySteps(
        run_dir.resolve().name, OdometryForm.INCREMENTS, columns["t_s"][read[1:]], start, truth, claimed
    )


def read_columns(path: Path, names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Read columns of a parquet file as float arrays.

    Raises
    ------
    InputError
        Where the file is missing, is no parquet file, lacks a column, or its times do not increase.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.is_file():
        raise InputError(f"{path}: expected a run folder's trace, found none there")
    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{path}: expected a parquet file, found: {error}") from None
    missing = [name for name in names if name not in table.column_names]
    if missing:
        raise InputError(f"{path}: expected the columns {', '.join(names)}; missing: {', '.join(missing)}")
    columns = {name: np.asarray(table[name].to_numpy(), dtype=np.float64) for name in names}
    wrong = np.flatnonzero(~(np.diff(columns["t_s"]) > 0.0))
    if wrong.size:
        raise InputError(f"{path} row {int(wrong[0]) + 2}: expected a time after that of the row before")
    return columns
