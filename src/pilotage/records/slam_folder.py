"""The folder of ``pilotage slam`` as its page reads it: numbers, closures, map, path and keyframes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pilotage.core.errors import InputError
from pilotage.core.files import read_json
from pilotage.core.limits import DATA_BYTES
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.trajectories import read_tum
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import read_ros_map
from pilotage.records.arrays import Arrays, read_arrays
from pilotage.records.numbers import FARTHEST_M
from pilotage.records.reading import broken, cleaned, is_there, object_of

CLOSURES_FILE = "closures.json"
FILES = ("metrics.json", CLOSURES_FILE, "map.yaml", "before.tum", "covariances.npz", "keyframes.npz")
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
    times_real_time: float = _FINITE
    warnings: tuple[str, ...]


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
    ranges_m, beams, first_angle_rad, angle_step_rad
        Their scans: (K, B) of which the first ``beams`` (K,) count, direction of the first, and between them.
    extents
        (S, 3) first, last and reference keyframe of each submap.
    """

    folder: Path
    metrics: Mapping[str, Any]
    closures: list[ClosureRow]
    grid: OccupancyGrid
    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    covariances: FloatArray
    keyframes: IntArray
    keyframe_poses: FloatArray
    keyframe_before: FloatArray
    points_xy_m: NDArray[np.float32]
    starts: IntArray
    ranges_m: NDArray[np.float32]
    beams: IntArray
    first_angle_rad: FloatArray
    angle_step_rad: FloatArray
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
        t_s = _times(known)
        count = t_s.size
        poses, covariances = (
            _finite(known, part, count, *shape) for part, shape in (("poses", (3,)), ("covariances", (3, 3)))
        )
        keyframe_poses = _finite(known, "graph_poses", -1, 3)
        name = "keyframes.npz"
        keyframes = _Keyframes(_arrays(folder / name), len(keyframe_poses), count)
        name = CLOSURES_FILE
        _require_submaps(closures, len(keyframes.extents))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise _damaged(folder / name, f"{where}: {first['msg'].lower()}") from None
    except ValueError as error:
        raise _damaged(folder / name, error) from None
    before = read_tum(folder / "before.tum")
    if len(before) != count:
        raise _damaged(folder / "before.tum", f"expected {count} poses, found {len(before)}")
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
        keyframes.scans,
        keyframe_poses,
        keyframes.before,
        keyframes.points_xy_m,
        keyframes.starts,
        keyframes.ranges_m,
        keyframes.beams,
        keyframes.first_angle_rad,
        keyframes.angle_step_rad,
        keyframes.extents,
    )


class _Keyframes:
    """Arrays of ``keyframes.npz``, which fit each other, ``count`` keyframes and ``scans`` scans."""

    def __init__(self, file: Arrays, count: int, scans: int) -> None:
        self.scans = file.ints("scans", count)
        self.before = _finite(file, "before", count, 3)
        self.starts = file.ints("starts", count + 1)
        self.points_xy_m = _finite(file, "points_xy_m", -1, 2).astype(np.float32)
        self.beams = file.ints("beams", count)
        self.ranges_m = file.floats("ranges_m", count, -1).astype(np.float32)
        self.first_angle_rad = _finite(file, "first_angle_rad", count)
        self.angle_step_rad = _finite(file, "angle_step_rad", count)
        self.extents = file.ints("extents", -1, 3)
        first, last, reference = self.extents.T
        fits = {
            "scans": _within(self.scans, -1, scans - 1),
            "starts": _within(self.starts, 0, len(self.points_xy_m))
            and bool((np.diff(self.starts) >= 0).all()),
            "beams": _within(self.beams, 0, self.ranges_m.shape[1]),
            "angle_step_rad": bool((np.abs(self.angle_step_rad) > 1e-9).all()),
            "extents": _within(self.extents, 0, count - 1)
            and bool(((first <= reference) & (reference <= last)).all()),
        }
        for name, right in fits.items():
            if not right:
                raise ValueError(f"{name}: expected those of {count} keyframes, found others")


def _arrays(path: Path) -> Arrays:
    found = read_arrays(path, DATA_BYTES)
    if found is None:
        raise ValueError("expected arrays, found none")
    return found


def _times(file: Arrays) -> FloatArray:
    t_s = file.floats("t_s", -1)
    if t_s.size < 1 or not bool((np.abs(t_s) <= 1e12).all()):
        raise ValueError("t_s: expected finite times of at least one scan")
    return t_s


def _finite(file: Arrays, name: str, *shape: int) -> FloatArray:
    out = file.floats(name, *shape)
    if not bool((np.abs(out) <= FARTHEST_M).all()):
        raise ValueError(f"{name}: expected numbers within {FARTHEST_M:g}")
    return out


def _within(values: IntArray, low: int, high: int) -> bool:
    return not values.size or (int(values.min()) >= low and int(values.max()) <= high)


def _require_submaps(closures: list[ClosureRow], count: int) -> None:
    for row in closures:
        if max(row.earlier_submap, row.later_submap) >= count:
            raise ValueError(f"closure {row.number}: expected submaps below {count}, found others")
        if not bool((np.abs(row.relative) <= FARTHEST_M).all()):
            raise ValueError(f"closure {row.number}: expected finite numbers, found others")


def _damaged(path: Path, problem: object) -> InputError:
    line = str(broken(path, problem))
    return InputError(line.replace("run the mission again", "map the recording again"))
