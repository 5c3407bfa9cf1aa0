"""The ground of a terrain mission: from the generator, from images, from elevation, from any grid map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.maps.crater_cache import cached_crater_terrain
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.elevation_file import read_elevation
from pilotage.maps.grid_file import read_grid
from pilotage.maps.grid_image import read_grey, read_hazard_image
from pilotage.maps.landmark_image import read_landmark_image
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.missions.terrain import CraterGround, ElevationGround, GroundChoice, ImagesGround


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What is known of the ground.

    Attributes
    ----------
    hazards
        Where a rover must not go.
    elevation
        Heights, where there are any.
    slope_limit_deg
        What is steeper is a hazard; None where the hazards were given as such.
    landmarks
        Points that can be recognized.
    environment
        (rows, columns) a grey picture that came with the ground.
    """

    hazards: OccupancyGrid
    elevation: ElevationModel | None = None
    slope_limit_deg: float | None = None
    landmarks: Landmarks | None = None
    environment: NDArray[np.uint8] | None = None

    def picture(self, most_columns: int) -> tuple[NDArray[np.uint8] | None, NDArray[np.uint8]]:
        """Grey pictures of the ground, where there is one, and of the hazards, white where blocked.

        Both made of every n-th row and column, or of n x n cells, so that neither is wider.
        """
        step = max(1, math.ceil(max(self.hazards.rows, self.hazards.columns) / most_columns))
        seen = None
        if self.environment is not None:
            seen = self.environment[::step, ::step]
        elif self.elevation is not None:
            coarse = self.elevation.elevation_m[::step, ::step]
            if min(coarse.shape) >= 2:
                seen = ElevationModel(coarse, self.elevation.resolution_m * step).shaded()
        return seen, shares(self.hazards.blocked(), step)


def shares(mask: NDArray[np.bool_], step: int) -> NDArray[np.uint8]:
    """Share of marked cells in every block of ``step`` x ``step``, 0 to 255; the last blocks may be cut."""
    rows, columns = mask.shape
    at_row, at_column = np.arange(0, rows, step), np.arange(0, columns, step)
    counts = np.add.reduceat(mask.view(np.uint8), at_row, axis=0, dtype=np.uint16)
    counts = np.add.reduceat(counts, at_column, axis=1, dtype=np.uint32)
    sizes = np.diff(np.append(at_row, rows))[:, None] * np.diff(np.append(at_column, columns))
    return np.asarray((255 * counts + sizes // 2) // sizes, dtype=np.uint8)


def load_ground(choice: GroundChoice) -> Ground:
    """Make or read the ground.

    Raises
    ------
    InputError
        Where a file cannot be used or does not fit the others.
    """
    if isinstance(choice, CraterGround):
        terrain = cached_crater_terrain(choice)
        return Ground(terrain.hazards, terrain.elevation, choice.slope_limit_deg, terrain.landmarks)
    if isinstance(choice, ImagesGround):
        return _from_images(choice)
    path = Path(choice.file)
    origin = None if choice.origin is None else Pose2(*choice.origin)
    if isinstance(choice, ElevationGround):
        elevation = read_elevation(path, origin, choice.resolution_m)
        return Ground(elevation.hazards(choice.slope_limit_deg), elevation, choice.slope_limit_deg)
    if path.suffix.lower() == ".json":
        raise InputError(f"world.ground.file: expected a grid map, found '{path}'; take name: elevation")
    return Ground(read_grid(path, choice.resolution_m, origin))


def _from_images(choice: ImagesGround) -> Ground:
    origin = Pose2(*choice.origin_m, 0.0)
    hazards = read_hazard_image(Path(choice.obstacles), choice.resolution_m, origin)
    size = hazards.cells.shape
    environment = None
    if choice.environment is not None:
        environment, _ = read_grey(Path(choice.environment), (int(size[0]), int(size[1])))
    landmarks = None
    if choice.landmarks is not None:
        landmarks = read_landmark_image(
            Path(choice.landmarks), choice.resolution_m, origin, (int(size[0]), int(size[1]))
        )
    return Ground(hazards, None, None, landmarks, environment)
