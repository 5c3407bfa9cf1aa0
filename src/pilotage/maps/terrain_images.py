"""The three images that the rover report lists: ground, obstacles, landmarks."""

from __future__ import annotations

from pathlib import Path

from pilotage.maps.crater_terrain import CraterTerrain
from pilotage.maps.grid_image import write_grey, write_hazard_image
from pilotage.maps.landmark_image import write_landmark_image


def write_terrain_images(folder: Path, terrain: CraterTerrain) -> tuple[Path, Path, Path]:
    """Write ``environment.png`` (shaded), ``obstacles.png`` (white is too steep) and ``landmarks.png``.

    Returns
    -------
    Their paths, in this order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = folder / "environment.png", folder / "obstacles.png", folder / "landmarks.png"
    ground = terrain.elevation.shaded()
    write_grey(paths[0], ground)
    write_hazard_image(paths[1], terrain.hazards)
    write_landmark_image(paths[2], ground, terrain.hazards, terrain.landmarks)
    return paths
