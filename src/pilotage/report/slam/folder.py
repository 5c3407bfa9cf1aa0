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
    """Files of the folder as arrays.

    Attributes
    ----------
    poses, before
        (N, 3) of the recording's scans after and before, and ``covariances`` (N, 3, 3).
    keyframes
        (K,) scans of the graph's keyframes, -1 for those of an earlier map that this one extends;
        ``keyframe_poses`` and ``keyframe_before`` (K, 3) where they lie and lay.
    points_xy_m, starts
        Points of the keyframes, one after the other.
    extents
        (S, 3) first, last and reference keyframe of each submap.
    """

    folder: Path
    metrics: dict[str, Any]
    closures: list[dict[str, Any]]
    grid: OccupancyGrid
    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    covariances: FloatArray
    keyframes: IntArray
    keyframe_poses: FloatArray
    keyframe_before: FloatArray
    points_xy_m: FloatArray
    starts: IntArray
    extents: IntArray

    @property
    def since(self) -> int:
        """How many keyframes are those of an earlier map."""
        return int(np.count_nonzero(self.keyframes < 0))

    def submap(self, number: int) -> FloatArray:
        """Points (K, 2) of a submap in its reference's frame."""
        first, last, reference = (int(v) for v in self.extents[number])
        out = []
        for k in range(first, last + 1):
            cloud = self.points_xy_m[self.starts[k] : self.starts[k + 1]].astype(np.float64)
            out.append(seen_from(self.keyframe_poses[reference], placed(cloud, self.keyframe_poses[k])))
        return np.concatenate(out)

    def reference(self, submap: int) -> FloatArray:
        """(3,) pose of a submap's reference keyframe."""
        return np.asarray(self.keyframe_poses[self.extents[submap, 2]])


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
    missing = [
        name for name in ("scans", "before", "points_xy_m", "starts", "extents") if name not in keyframes
    ]
    if missing:
        raise InputError(
            f"{folder / 'keyframes.npz'}: expected {missing[0]}, found none; map the recording anew"
        )
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
        known["graph_poses"],
        keyframes["before"],
        keyframes["points_xy_m"],
        keyframes["starts"],
        keyframes["extents"],
    )
