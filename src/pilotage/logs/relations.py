"""Relations of the SLAM benchmark: true motions between pairs of moments, checked by hand.

``t1 t2 x y z roll pitch yaw`` a line, seconds, metres and radians: the robot's pose at t2 as seen from that
at t1 (Kuemmerle and others, "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, 2009).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.logs.text import check_size, read_table

COLUMNS = ("t1", "t2", "x", "y", "z", "roll", "pitch", "yaw")
LARGEST_M = 1e6


@dataclass(frozen=True, slots=True)
class Relations:
    """True motions: times (K,) each, ``points_xyz_m`` (K, 3), ``roll_pitch_yaw_rad`` (K, 3)."""

    first_s: FloatArray
    second_s: FloatArray
    points_xyz_m: FloatArray
    roll_pitch_yaw_rad: FloatArray

    def __len__(self) -> int:
        return int(self.first_s.shape[0])

    def planar(self) -> FloatArray:
        """Return (K, 3) x, y, yaw."""
        return np.column_stack([self.points_xyz_m[:, :2], self.roll_pitch_yaw_rad[:, 2]])


def read_relations(path: Path) -> Relations:
    """Read relations, plain or gzipped.

    Raises
    ------
    InputError
        File and line of what is cut short, no number, or not finite; or where there is none.
    """
    table = read_table(path, COLUMNS)
    check_size(table, COLUMNS, first=2, most=LARGEST_M)
    values = table.values
    return Relations(values[:, 0].copy(), values[:, 1].copy(), values[:, 2:5].copy(), values[:, 5:].copy())
