"""A grid map from whatever file holds one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.arrays import read_npy
from pilotage.core.types import Pose2
from pilotage.maps.grid_image import GEOTIFF, IMAGES, read_hazard_image
from pilotage.maps.memory import require_memory
from pilotage.maps.moving_ai import read_moving_ai_map
from pilotage.maps.occupancy_grid import CORNER, OccupancyGrid
from pilotage.maps.ros_map import read_ros_map

GRID_SUFFIXES = frozenset({".map", ".npy", ".yaml", ".yml"}) | IMAGES


def read_grid(path: Path, resolution_m: float | None = None, origin: Pose2 | None = None) -> OccupancyGrid:
    """Read a grid map by the suffix of its file.

    Parameters
    ----------
    resolution_m, origin
        For files that do not say: images (white is an obstacle) need a resolution; MovingAI maps and
        arrays (``.npy``, see ``OccupancyGrid.of``) take 1 m without one. Not for ROS maps, which say.

    Raises
    ------
    InputError
        Where the file is missing or is not what its suffix says, or the resolution is missing.
    """
    suffix = path.suffix.lower()
    if suffix in (".yaml", ".yml"):
        if resolution_m is not None or origin is not None:
            raise InputError(
                f"{path}: resolution and origin: expected in the YAML file, found both there and here"
            )
        return read_ros_map(path).grid
    place = CORNER if origin is None else origin
    if suffix == ".map":
        return read_moving_ai_map(path).grid(1.0 if resolution_m is None else resolution_m, place)
    if suffix == ".npy":
        return OccupancyGrid.of(
            _whole(read_array(path), path), 1.0 if resolution_m is None else resolution_m, place
        )
    if suffix in IMAGES:
        if resolution_m is None:
            heights = f"; heights: {{name: elevation, file: {path.name}}}" if suffix in GEOTIFF else ""
            raise InputError(
                f"{path}: expected a resolution in metres a pixel for an image (white is an obstacle), found "
                "none: plan --set map.resolution_m=0.05, draw --resolution 0.05, in a mission world.map: "
                f"{{name: grid, file: {path.name}, resolution_m: 0.05}}; dark walls on white: a ROS map's "
                f"YAML with image, resolution and origin{heights}"
            )
        return read_hazard_image(path, resolution_m, place)
    raise InputError(f"{path}: expected a grid map ({', '.join(sorted(GRID_SUFFIXES))}), found '{suffix}'")


def read_array(path: Path) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
    """Load a NumPy file without running anything that it may hold."""
    values = read_npy(path)
    require_memory(2 * values.nbytes, f"array '{path}'")
    return values


def _whole(
    values: np.ndarray[tuple[int, ...], np.dtype[np.generic]], path: Path
) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
    """Refuse fractions: heights in metres would pass for probabilities where they happen to be small."""
    if values.dtype.kind == "f":
        raise InputError(
            f"array '{path}': expected a grid of truth values or of whole per cent, found {values.dtype}; "
            "save probabilities p as (100 * p).round().astype('int8'); heights: plan with --slope-limit, "
            f"in a mission world.map: {{name: elevation, file: {path.name}}}"
        )
    return values
