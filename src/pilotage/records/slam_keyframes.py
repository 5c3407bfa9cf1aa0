"""Keyframes of a mapped recording: what they measured, their points, and the submaps they make up."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.config import FARTHEST_M
from pilotage.core.limits import DATA_BYTES
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.arrays import Arrays, read_arrays, write_arrays

KEYFRAMES_FILE = "keyframes.npz"
LATEST_S = 1e12


@dataclass(frozen=True, slots=True)
class Keyframes:
    """Arrays of ``keyframes.npz``, each under its name.

    Attributes
    ----------
    scans
        (K,) scans of the recording, -1 for keyframes of an earlier map that this one extends.
    t_s
        (K,) when they were taken.
    before
        (K, 3) where they lay before any closure.
    points_xy_m, starts
        Points of the keyframes, one after the other; those of keyframe k begin at ``starts[k]`` (K + 1,).
    ranges_m, beams, first_angle_rad, angle_step_rad
        (K, B) of which the first ``beams`` (K,) count, direction of the first, and between them.
    extents
        (S, 3) first, last and reference keyframe of each submap.
    breaks
        (B,) keyframes that do not follow the path of the one before.
    """

    scans: IntArray
    t_s: FloatArray
    before: FloatArray
    points_xy_m: NDArray[np.float32]
    starts: IntArray
    ranges_m: NDArray[np.float32]
    beams: IntArray
    first_angle_rad: FloatArray
    angle_step_rad: FloatArray
    extents: IntArray
    breaks: IntArray

    def __len__(self) -> int:
        return int(self.scans.size)

    @property
    def since(self) -> int:
        """How many are those of an earlier map."""
        return int(np.count_nonzero(self.scans < 0))


def write_keyframes(path: Path, keyframes: Keyframes) -> None:
    """Write the file."""
    write_arrays(path, {part.name: getattr(keyframes, part.name) for part in dataclasses.fields(keyframes)})


def read_keyframes(path: Path, count: int) -> Keyframes:
    """Read those of a graph of ``count`` keyframes.

    Raises
    ------
    InputError
        Where it is no archive of arrays.
    ValueError
        Where an array is missing, damaged, or not of so many keyframes.
    """
    file = read_arrays(path, DATA_BYTES)
    if file is None:
        raise ValueError("expected arrays, found none")
    read = Keyframes(
        scans=file.ints("scans", count),
        t_s=file.finite("t_s", count, most=LATEST_S),
        before=file.finite("before", count, 3),
        points_xy_m=file.finite("points_xy_m", -1, 2).astype(np.float32),
        starts=file.ints("starts", count + 1),
        ranges_m=_ranges(file, count),
        beams=file.ints("beams", count),
        first_angle_rad=file.finite("first_angle_rad", count),
        angle_step_rad=file.finite("angle_step_rad", count),
        extents=file.ints("extents", -1, 3),
        breaks=file.ints("breaks", -1),
    )
    first, last, reference = read.extents.T
    starts, breaks = read.starts, read.breaks
    fits = {
        "scans": within(read.scans, -1, np.iinfo(np.int32).max),
        "starts": within(starts, 0, len(read.points_xy_m)) and bool((np.diff(starts) >= 0).all()),
        "beams": within(read.beams, 0, read.ranges_m.shape[1]),
        "angle_step_rad": bool((np.abs(read.angle_step_rad) > 1e-9).all()),
        "extents": within(read.extents, 0, count - 1)
        and bool(((first <= reference) & (reference <= last)).all()),
        "breaks": within(breaks, 1, count - 1) and bool((np.diff(breaks) > 0).all()),
    }
    for name, right in fits.items():
        if not right:
            raise ValueError(f"{name}: expected those of {count} keyframes, found others")
    return read


def _ranges(file: Arrays, count: int) -> NDArray[np.float32]:
    """NaN where nothing was measured, infinite where nothing was hit."""
    ranges = file.floats("ranges_m", count, -1)
    if bool((np.abs(ranges[np.isfinite(ranges)]) > FARTHEST_M).any()):
        raise ValueError(f"ranges_m: expected numbers within {FARTHEST_M:g}")
    return ranges.astype(np.float32)


def within(values: IntArray, low: int, high: int) -> bool:
    """Say whether all of them, or none, lie between two limits."""
    return not values.size or (int(values.min()) >= low and int(values.max()) <= high)
