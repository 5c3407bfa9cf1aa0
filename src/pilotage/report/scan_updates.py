"""The explained updates of a run folder: what a localizer saw in a scan, matched, accepted, and why not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.stack.interface import LineVerdict

VERDICTS = tuple(LineVerdict)
"""In the order in which the file numbers them."""


@dataclass(frozen=True, slots=True)
class RecordedUpdate:
    """One update, all in the map frame as it was believed before the update.

    Attributes
    ----------
    t_s, why
        When it was, and why it was kept.
    sensor_pose, sensor_pose_after
        (3,) of the scanner before and after.
    points_m, clusters, members
        (N, 2) the scan, and per point its cluster and its line, -1 for none.
    ends_m, walls_m
        (L, 4) the lines, and the walls that they were matched to (nan for none).
    distances, gate, verdicts
        Squared Mahalanobis distances (L,), the gate's chi-square value, and what became of each line.
    """

    t_s: float
    why: str
    sensor_pose: FloatArray
    sensor_pose_after: FloatArray
    points_m: FloatArray
    clusters: IntArray
    members: IntArray
    ends_m: FloatArray
    walls_m: FloatArray
    distances: FloatArray
    gate: float
    verdicts: tuple[LineVerdict, ...]


def read_updates(path: Path) -> tuple[RecordedUpdate, ...]:
    """Read ``updates.npz``.

    Raises
    ------
    KeyError, ValueError, IndexError, OSError
        Where the file is not what a run writes.
    """
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: np.asarray(archive[name]) for name in archive.files}
    updates: list[RecordedUpdate] = []
    while f"t_s_{len(updates)}" in arrays:
        k = len(updates)
        pose = np.asarray(arrays[f"sensor_pose_{k}"], dtype=np.float64).reshape(3)
        ends = np.asarray(arrays[f"ends_m_{k}"], dtype=np.float64).reshape(-1, 4)
        updates.append(
            RecordedUpdate(
                t_s=float(arrays[f"t_s_{k}"]),
                why=str(arrays[f"why_{k}"]),
                sensor_pose=pose,
                sensor_pose_after=np.asarray(arrays[f"sensor_pose_after_{k}"], dtype=np.float64).reshape(3),
                points_m=_placed(pose, arrays[f"points_m_{k}"].astype(np.float64)),
                clusters=arrays[f"clusters_{k}"].astype(np.int64),
                members=arrays[f"members_{k}"].astype(np.int64),
                ends_m=_placed(pose, ends.reshape(-1, 2)).reshape(-1, 4),
                walls_m=np.asarray(arrays[f"walls_m_{k}"], dtype=np.float64).reshape(-1, 4),
                distances=np.asarray(arrays[f"distances_{k}"], dtype=np.float64).reshape(-1),
                gate=float(arrays[f"gate_{k}"]),
                verdicts=tuple(VERDICTS[int(v)] for v in arrays[f"verdicts_{k}"].reshape(-1)),
            )
        )
    return tuple(updates)


def _placed(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points (N, 2) of the sensor's frame in the map frame."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + pose[:2])
