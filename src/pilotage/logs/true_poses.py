"""Where the robot of a recording truly was: a topic of its bag, or a path of its own such as SLAM's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.logs.bag_kinds import TRUTH
from pilotage.logs.bag_series import Series, read_poses
from pilotage.logs.trajectories import read_tum


def true_poses(log: Path, truth: str | None) -> Series:
    """Poses (N, 7) of a TUM file with the bag's clock, else of a bag's topic (``read_poses``).

    Parameters
    ----------
    truth
        A file, a topic or ``/tf:PARENT:CHILD``; None: one of the usual topics.

    Raises
    ------
    InputError
        Where there is none; the message tells what the bag holds.
    """
    if truth is None or not Path(truth).is_file():
        return read_poses(log, truth, TRUTH)
    path = read_tum(Path(truth))
    assert path.t_s is not None, "TUM has times"
    half_rad = 0.5 * np.arctan2(path.rotations[:, 1, 0], path.rotations[:, 0, 0])
    level = np.zeros((len(path), 2))
    values = np.column_stack([path.points_xyz_m, level, np.sin(half_rad), np.cos(half_rad)])
    return Series(Path(truth).name, "", path.t_s, values)
