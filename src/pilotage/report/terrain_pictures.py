"""Reads the small pictures of ground and hazards that a run on terrain leaves in its folder."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray

PICTURES_FILE = "terrain.npz"

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class TerrainPictures:
    """What is there of them.

    Attributes
    ----------
    ground
        (rows, columns) grey, lit from one side; None where nothing is known but hazards.
    hazards, looked_at
        Shares of blocked cells and of cells that the search queued, 0 to 255; the latter None where it
        was not told.
    size_m, origin
        Width and height, and the pose of the lower left corner.
    start, goal
        Where they were asked for.
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


def read_pictures(run_dir: Path) -> TerrainPictures | None:
    """The pictures in a run folder, None where it has none.

    Raises
    ------
    InputError
        Where the file is broken.
    """
    path = run_dir / PICTURES_FILE
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return TerrainPictures(
            _picture(arrays.get("ground")),
            _must(_picture(arrays["hazards"])),
            _picture(arrays.get("looked_at")),
            np.asarray(arrays["size_m"], dtype=np.float64),
            np.asarray(arrays["origin"], dtype=np.float64),
            np.asarray(arrays["start"], dtype=np.float64),
            np.asarray(arrays["goal"], dtype=np.float64),
            float(arrays["slope_limit_deg"]),
            np.asarray(arrays.get("landmarks", np.zeros((0, 2))), dtype=np.float64).reshape(-1, 2),
            np.asarray(arrays.get("route", np.zeros((0, 2))), dtype=np.float64).reshape(-1, 2),
            *_seen(arrays),
        )
    except (OSError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: cannot be read, {error}; run the mission again") from None


def _picture(array: NDArray[np.generic] | None) -> Picture | None:
    if array is None:
        return None
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"expected a picture, found shape {array.shape}")
    return np.asarray(array, dtype=np.uint8)


def _seen(arrays: Mapping[str, NDArray[Any]]) -> tuple[IntArray, IntArray]:
    """Counts and landmarks; nothing where they do not fit each other."""
    nothing = np.zeros(0, dtype=np.int64)
    counts = np.asarray(arrays.get("seen_counts", nothing), dtype=np.int64)
    seen = np.asarray(arrays.get("seen", nothing), dtype=np.int64)
    known = len(arrays.get("landmarks", nothing))
    sound = bool((counts >= 0).all() and (seen >= 0).all() and (seen < known).all())
    return (counts, seen) if sound and counts.sum() == len(seen) else (nothing, nothing)


def _must(picture: Picture | None) -> Picture:
    if picture is None:
        raise ValueError("expected hazards")
    return picture
