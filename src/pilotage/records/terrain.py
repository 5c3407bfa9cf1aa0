"""``terrain.npz``: small pictures of ground, hazards and what a search looked at, and the places on it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.plans import places

TERRAIN_FILE = "terrain.npz"
MOST_PIXELS = 4_000_000

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class TerrainPictures:
    """What is there of them.

    Attributes
    ----------
    ground
        (rows, columns) grey, lit from one side; None where only hazards are known; all of one shape.
    hazards, looked_at
        Shares of blocked cells and of cells that the search queued, 0 to 255; the latter None where it
        was not told.
    size_m, origin
        (2,) width and height, and (3,) the pose of the lower left corner.
    start, goal
        (2,) where they were asked for.
    slope_limit_deg
        NaN where hazards were given as such.
    landmarks
        (M, 2) known points; none where the mission has no estimator.
    route
        (R, 2) the planned path's corners; none where there is no plan.
    seen_counts, seen
        (N,) how many landmarks were in sight at each row of the trace, and which (rows of ``landmarks``).
    """

    ground: Picture | None
    hazards: Picture
    looked_at: Picture | None
    size_m: FloatArray
    origin: FloatArray
    start: FloatArray
    goal: FloatArray
    slope_limit_deg: float
    landmarks: FloatArray
    route: FloatArray
    seen_counts: IntArray
    seen: IntArray


def write_terrain(folder: Path, pictures: TerrainPictures) -> None:
    """Write the pictures; without a plan, landmarks or a picture of the ground their arrays are left out."""
    arrays: dict[str, Any] = {
        "hazards": pictures.hazards,
        "size_m": pictures.size_m,
        "origin": pictures.origin,
        "start": pictures.start,
        "goal": pictures.goal,
        "slope_limit_deg": np.array(pictures.slope_limit_deg),
    }
    if pictures.ground is not None:
        arrays["ground"] = pictures.ground
    if pictures.looked_at is not None:
        arrays["looked_at"] = pictures.looked_at
    if len(pictures.route):
        arrays["route"] = pictures.route
    if len(pictures.landmarks) or len(pictures.seen_counts):
        arrays["landmarks"] = pictures.landmarks
        arrays["seen_counts"] = pictures.seen_counts.astype(np.int32)
        arrays["seen"] = pictures.seen.astype(np.int32)
    write_arrays(folder / TERRAIN_FILE, arrays, compressed=False)


def read_terrain(folder: Path) -> TerrainPictures | None:
    """Read the pictures; None where the run was on no terrain; InputError as ``read_record``."""
    return read_record(folder / TERRAIN_FILE, _pictures, None)


def _pictures(arrays: Arrays) -> TerrainPictures:
    landmarks = places(arrays, "landmarks", (2,))
    hazards = _picture(arrays, "hazards", (-1, -1))
    shape = (hazards.shape[0], hazards.shape[1])
    return TerrainPictures(
        _picture(arrays, "ground", shape) if "ground" in arrays else None,
        hazards,
        _picture(arrays, "looked_at", shape) if "looked_at" in arrays else None,
        _size(arrays),
        _place(arrays, "origin", 3),
        _place(arrays, "start", 2),
        _place(arrays, "goal", 2),
        arrays.scalar("slope_limit_deg"),
        landmarks,
        places(arrays, "route", (2,)),
        *_seen(arrays, len(landmarks)),
    )


def _picture(arrays: Arrays, name: str, shape: tuple[int, int]) -> Picture:
    picture = arrays.bytes(name, *shape)
    if not 0 < picture.size <= MOST_PIXELS:
        raise ValueError(f"{name}: expected a picture, found shape {picture.shape}")
    return picture


def _place(arrays: Arrays, name: str, count: int) -> FloatArray:
    found = arrays.floats(name, count)
    if not (np.abs(found) <= FARTHEST_M).all():
        raise ValueError(f"{name}: expected {count} numbers within {FARTHEST_M:g}")
    return found


def _size(arrays: Arrays) -> FloatArray:
    size = _place(arrays, "size_m", 2)
    if not (size > 0.0).all():
        raise ValueError("size_m: expected width and height above 0")
    return size


def _seen(arrays: Arrays, known: int) -> tuple[IntArray, IntArray]:
    """Counts and landmarks; nothing where they do not fit each other."""
    nothing = np.zeros(0, dtype=np.int64)
    if "seen" not in arrays or "seen_counts" not in arrays:
        return nothing, nothing
    counts, seen = arrays.ints("seen_counts", -1), arrays.ints("seen", -1)
    sound = bool((counts >= 0).all() and (seen >= 0).all() and (seen < known).all())
    fits = sound and int(np.minimum(counts, len(seen) + 1).sum()) == len(seen)
    return (counts, seen) if fits else (nothing, nothing)
