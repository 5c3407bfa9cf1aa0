"""Crater terrain kept on disk: made once, then mapped into memory where it is looked at."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from pathlib import Path

import numpy as np
import scipy

from pilotage.core.drafts import clear_drafts, draft_prefix
from pilotage.core.errors import InputError
from pilotage.core.files import read_bytes
from pilotage.core.files.arrays import map_npy
from pilotage.core.types import Pose2
from pilotage.kernels.user_cache import user_cache
from pilotage.maps import crater_terrain as generator
from pilotage.maps.crater_terrain import CraterTerrain, CraterTerrainConfig, crater_terrain
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.occupancy_grid import OccupancyGrid

WORTH_KEEPING_CELLS = 1_000_000
"""Smaller terrain is made quicker than it is found."""

MOST_KEPT = 4
"""The one used longest ago goes first; 13.5 million cells take 68 MB."""


def cached_crater_terrain(config: CraterTerrainConfig) -> CraterTerrain:
    """As ``crater_terrain``, bit for bit, from the cache where it is there.

    Kept under a digest of the config, of the generator's source and of the versions of what it calculates
    with. A cache that cannot be written or read is done without.
    """
    if config.rows * config.columns < WORTH_KEEPING_CELLS:
        return crater_terrain(config)
    folder = user_cache("terrain")
    if folder is None:
        return crater_terrain(config)
    place = folder / _digest(config)
    try:
        return _read(place, config)
    except (OSError, ValueError, InputError):
        shutil.rmtree(place, ignore_errors=True)  # what is damaged would be in the way for ever
    terrain = crater_terrain(config)
    try:
        _write(place, terrain)
        _thin_out(folder)
        return _read(place, config)
    except (OSError, ValueError, InputError):
        return terrain


def _digest(config: CraterTerrainConfig) -> str:
    values = CraterTerrainConfig(**{name: getattr(config, name) for name in CraterTerrainConfig.model_fields})
    sha = hashlib.sha256(f"{values.model_dump_json()} {np.__version__} {scipy.__version__}".encode())
    sha.update(read_bytes(Path(generator.__file__)))
    return sha.hexdigest()[:20]


def _write(place: Path, terrain: CraterTerrain) -> None:
    """Beside it first: two runs at once do not read halves."""
    draft = Path(tempfile.mkdtemp(prefix=draft_prefix(place), dir=place.parent))
    try:
        np.save(draft / "elevation.npy", terrain.elevation.elevation_m)
        np.save(draft / "hazards.npy", terrain.hazards.cells)
        np.save(draft / "landmark_ids.npy", terrain.landmarks.ids)
        np.save(draft / "landmarks.npy", terrain.landmarks.points_xy_m)
        draft.rename(place)
    except OSError:
        if not place.is_dir():  # else another process was quicker
            raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    clear_drafts(place)


def _read(place: Path, config: CraterTerrainConfig) -> CraterTerrain:
    origin = Pose2(*config.origin_m, 0.0)
    heights = map_npy(place / "elevation.npy")
    cells = map_npy(place / "hazards.npy")
    if heights.shape != (config.rows, config.columns) or cells.shape != heights.shape:
        raise ValueError("another terrain")
    marks = Landmarks(
        np.array(map_npy(place / "landmark_ids.npy")),
        np.array(map_npy(place / "landmarks.npy")),
    )
    # When it was last used is what thinning out goes by.
    place.touch()
    return CraterTerrain(
        ElevationModel(heights, config.resolution_m, origin),
        OccupancyGrid(cells, config.resolution_m, origin),
        marks,
    )


def _thin_out(folder: Path) -> None:
    kept = sorted(
        (path for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")),
        key=lambda path: path.stat().st_mtime,
    )
    for path in kept[:-MOST_KEPT]:
        shutil.rmtree(path, ignore_errors=True)
