"""What the page reads of a folder that ``pilotage slam`` wrote."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_json, read_text
from pilotage.core.files.arrays import read_npz
from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import read_ros_map


@dataclass(frozen=True, slots=True)
class SlamFolder:
    """Files of the folder as arrays: poses (N, 3) of the scans after and before, points of the keyframes."""

    folder: Path
    metrics: dict[str, Any]
    closures: list[dict[str, Any]]
    grid: OccupancyGrid
    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    covariances: FloatArray
    keyframes: IntArray
    points_xy_m: FloatArray
    starts: IntArray
    extents: IntArray

    def submap(self, number: int, poses: FloatArray) -> FloatArray:
        """Points (K, 2) of a submap with its keyframes at given scan poses, in its reference's frame."""
        first, last, reference = (int(v) for v in self.extents[number])
        frame = poses[self.keyframes[reference]]
        out = []
        for k in range(first, last + 1):
            cloud = self.points_xy_m[self.starts[k] : self.starts[k + 1]].astype(np.float64)
            out.append(seen_from(frame, placed(cloud, poses[self.keyframes[k]])))
        return np.concatenate(out)


def placed(points: FloatArray, pose: FloatArray) -> FloatArray:
    """Points (K, 2) of a frame at a pose (3,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + pose[:2])


def seen_from(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points (K, 2) as seen from a pose (3,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray((points - pose[:2]) @ np.array([[c, -s], [s, c]]))


def read_slam_folder(folder: Path) -> SlamFolder:
    """Read a folder.

    Raises
    ------
    InputError
        Where a file is missing.
    """
    names = ("metrics.json", "closures.json", "map.yaml", "before.tum", "covariances.npz", "keyframes.npz")
    for name in names:
        if not (folder / name).is_file():
            raise InputError(f"{folder}: expected what 'pilotage slam' writes, found no {name}")
    known, keyframes = read_npz(folder / "covariances.npz"), read_npz(folder / "keyframes.npz")
    before = np.loadtxt(io.StringIO(read_text(folder / "before.tum")), ndmin=2)
    theta = 2.0 * np.arctan2(before[:, 6], before[:, 7])
    return SlamFolder(
        folder,
        read_json(folder / "metrics.json"),
        read_json(folder / "closures.json"),
        read_ros_map(folder / "map.yaml").grid,
        known["t_s"],
        known["poses"],
        np.column_stack([before[:, 1:3], theta]),
        known["covariances"],
        keyframes["scans"],
        keyframes["points_xy_m"],
        keyframes["starts"],
        keyframes["extents"],
    )
