"""The folder of ``pilotage slam`` as its page reads it: numbers, closures, map, path and keyframes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.files import read_json
from pilotage.core.limits import DATA_BYTES
from pilotage.core.types import FloatArray, Pose2
from pilotage.logs.trajectories import read_tum
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import read_ros_map
from pilotage.records.arrays import Arrays, read_arrays
from pilotage.records.reading import broken, cleaned, is_there, object_of
from pilotage.records.slam_keyframes import KEYFRAMES_FILE, LATEST_S, Keyframes, read_keyframes, within

CLOSURES_FILE = "closures.json"
AGAIN = "map the recording again"
FILES = ("metrics.json", CLOSURES_FILE, "map.yaml", "before.tum", "covariances.npz", KEYFRAMES_FILE)
_FINITE = Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)
_COUNT = Field(ge=0, le=2**31)


class ClosureRow(BaseModel):
    """A row of ``closures.json``: two stretches that were compared, and what was found."""

    model_config = ConfigDict(frozen=True)

    number: int = _COUNT
    earlier_scan: int | None
    later_scan: int = _COUNT
    later_t_s: float = Field(ge=-1e12, le=1e12, allow_inf_nan=False)
    earlier_submap: int = _COUNT
    later_submap: int = _COUNT
    window_m: float = _FINITE
    relative: tuple[float, float, float]
    score: float = _FINITE
    second_score: float = _FINITE
    agreement: float = _FINITE
    chi_square: float | None
    support: int = _COUNT
    accepted: bool
    verdict: str


class SlamNumbers(BaseModel):
    """What the page needs of ``metrics.json``; there is more in it, which stays as it is."""

    model_config = ConfigDict(extra="allow", frozen=True)

    log: str
    scans: int = _COUNT
    path_length_m: float = _FINITE
    closures_searched: int = _COUNT
    closures_accepted: int = _COUNT
    closures_by_verdict: dict[str, int]
    map_rows: int = _COUNT
    map_columns: int = _COUNT
    resolution_m: float = _FINITE
    position_std_max_m: float = _FINITE
    times_real_time: float = Field(allow_inf_nan=False)
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SlamFolder:
    """Files of the folder as arrays.

    Attributes
    ----------
    poses, before
        (N, 3) of the recording's scans after and before, and ``covariances`` (N, 3, 3).
    keyframes
        What the graph's keyframes measured; ``keyframe_poses`` (K, 3) where they lie.
    """

    folder: Path
    metrics: Mapping[str, Any]
    closures: list[ClosureRow]
    grid: OccupancyGrid
    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    covariances: FloatArray
    keyframes: Keyframes
    keyframe_poses: FloatArray

    def submap(self, number: int) -> FloatArray:
        """Points (K, 2) of a submap in its reference's frame."""
        frames = self.keyframes
        first, last, reference = (int(v) for v in frames.extents[number])
        out = []
        for k in range(first, last + 1):
            cloud = frames.points_xy_m[frames.starts[k] : frames.starts[k + 1]].astype(np.float64)
            placed = Pose2.from_array(self.keyframe_poses[k]).placed(cloud)
            out.append(Pose2.from_array(self.keyframe_poses[reference]).seen(placed))
        return np.concatenate(out)

    def reference(self, submap: int) -> FloatArray:
        """(3,) pose of a submap's reference keyframe."""
        return np.asarray(self.keyframe_poses[self.keyframes.extents[submap, 2]])


def is_slam_folder(folder: Path) -> bool:
    """Say whether a folder holds a mapped recording."""
    return (folder / CLOSURES_FILE).exists()


def read_slam_folder(folder: Path) -> SlamFolder:
    """Read a folder.

    Raises
    ------
    InputError
        One line, where a file is missing, damaged, or not of the same mapping as the others.
    """
    for name in FILES:
        if not is_there(folder / name):
            raise InputError(f"{folder}: expected what 'pilotage slam' writes, found no {name}")
    numbers = object_of(folder / "metrics.json", "the numbers of a mapped recording")
    rows = read_json(folder / CLOSURES_FILE, "the closures of a mapped recording")
    name = "metrics.json"
    try:
        metrics = SlamNumbers.model_validate(cleaned(numbers)).model_dump()
        name = CLOSURES_FILE
        closures = TypeAdapter(list[ClosureRow]).validate_python(cleaned(rows))
        name = "covariances.npz"
        known = _arrays(folder / name)
        t_s = known.finite("t_s", -1, most=LATEST_S)
        count = t_s.size
        if not count:
            raise ValueError("t_s: expected times of at least one scan")
        poses, covariances = known.finite("poses", count, 3), known.finite("covariances", count, 3, 3)
        keyframe_poses = known.finite("graph_poses", -1, 3)
        name = KEYFRAMES_FILE
        keyframes = read_keyframes(folder / name, len(keyframe_poses))
        if not within(keyframes.scans, -1, count - 1):
            raise ValueError(f"scans: expected those of {count} scans, found others")
        name = CLOSURES_FILE
        _require_submaps(closures, len(keyframes.extents))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise broken(folder / name, f"{where}: {first['msg'].lower()}", AGAIN) from None
    except ValueError as error:
        raise broken(folder / name, error, AGAIN) from None
    before = read_tum(folder / "before.tum")
    if len(before) != count:
        raise broken(folder / "before.tum", f"expected {count} poses, found {len(before)}", AGAIN)
    turned = np.arctan2(before.rotations[:, 1, 0], before.rotations[:, 0, 0])
    return SlamFolder(
        folder,
        metrics,
        closures,
        read_ros_map(folder / "map.yaml").grid,
        t_s,
        poses,
        np.column_stack([before.points_xyz_m[:, :2], turned]),
        covariances,
        keyframes,
        keyframe_poses,
    )


def _arrays(path: Path) -> Arrays:
    found = read_arrays(path, DATA_BYTES)
    if found is None:
        raise ValueError("expected arrays, found none")
    return found


def _require_submaps(closures: list[ClosureRow], count: int) -> None:
    for row in closures:
        if max(row.earlier_submap, row.later_submap) >= count:
            raise ValueError(f"closure {row.number}: expected submaps below {count}, found others")
        if not bool((np.abs(row.relative) <= FARTHEST_M).all()):
            raise ValueError(f"closure {row.number}: expected finite numbers, found others")
