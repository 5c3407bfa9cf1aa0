"""Elevation models from files: raw arrays with a JSON side file, ESRI ASCII grids, GeoTIFF, NumPy arrays."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.extras import missing
from pilotage.core.files import read_bytes, read_json, require_file
from pilotage.core.files.arrays import quiet
from pilotage.core.limits import DATA_BYTES, limit, too_large
from pilotage.core.types import Pose2
from pilotage.maps.ascii_grid import read_ascii_grid
from pilotage.maps.elevation import ElevationModel, HeightArray
from pilotage.maps.grid_file import read_array
from pilotage.maps.grid_image import GEOTIFF
from pilotage.maps.memory import require_memory
from pilotage.maps.occupancy_grid import CORNER

HEIGHTS_ALONE = frozenset({".json", ".asc"})
"""Suffixes of files that hold heights and nothing else."""
STEEPEST = 20.0
"""Times the map's diagonal that heights may span: beyond is a mark for unknown, or cells in degrees."""
MOST_BYTES = 12 * DATA_BYTES // 4
"""What a model takes while it is read: twelve bytes for each height of four."""
FORMATS = {
    "uint16-le": "<u2",
    "uint16-be": ">u2",
    "int16-le": "<i2",
    "int16-be": ">i2",
    "float32-le": "<f4",
    "float32-be": ">f4",
}


def read_elevation(
    path: Path, origin: Pose2 | None = None, resolution_m: float | None = None
) -> ElevationModel:
    """Read a JSON side file (and its raw array), an ESRI ASCII grid, a GeoTIFF, or a NumPy array of heights.

    Without ``origin`` a GeoTIFF or ASCII grid lies where it says, another model with its corner at 0, 0.
    Cells that are not square are stretched along the rows, linearly, until they are.

    Parameters
    ----------
    resolution_m
        Side of a cell, for arrays (``.npy``) only: the other files say.

    Raises
    ------
    InputError
        Where a file is missing, cut short, or does not say what is needed, and where its heights cannot be
        in the unit of its cells; for a GeoTIFF also where rasterio is not installed.
    """
    require_file(path, "an elevation model")
    with np.errstate(over="ignore", invalid="ignore"):  # what becomes infinite is refused
        model = _read(path, origin, resolution_m)
    rows, columns = model.elevation_m.shape
    low, high = (float(pick.reduce(model.elevation_m, axis=None)) for pick in (np.fmin, np.fmax))
    if high - low > STEEPEST * model.resolution_m * math.hypot(rows, columns):
        raise InputError(
            f"elevation '{path}': expected heights and cells in metres, found heights from {low:g} to "
            f"{high:g} on a map of {columns * model.resolution_m:g} x {rows * model.resolution_m:g}: a mark "
            "for unknown that the file does not name, or degrees (project it, gdalwarp)"
        )
    return model


def _read(path: Path, origin: Pose2 | None, resolution_m: float | None) -> ElevationModel:
    if path.suffix.lower() == ".npy":
        return _read_npy(path, resolution_m, CORNER if origin is None else origin)
    if resolution_m is not None:
        raise InputError(f"elevation '{path}': expected its resolution in the file, found one here as well")
    if path.suffix.lower() == ".json":
        return _read_raw(path, CORNER if origin is None else origin)
    if path.suffix.lower() == ".asc":
        return _read_ascii(path, origin)
    if path.suffix.lower() in GEOTIFF:
        return _read_geotiff(path, origin)
    raise InputError(
        f"elevation '{path}': expected .asc, .tif, .npy or a .json side file, found '{path.suffix}'; "
        "gdal_translate -of AAIGrid makes an .asc of most"
    )


def _read_npy(path: Path, resolution_m: float | None, origin: Pose2) -> ElevationModel:
    if resolution_m is None:
        raise InputError(f"elevation '{path}': expected a resolution in metres a cell, found none")
    heights = read_array(path)
    if heights.dtype.kind not in "iuf":
        raise InputError(f"elevation '{path}': expected heights as numbers, found {heights.dtype}")
    require_memory(12 * heights.size, f"elevation '{path}'")
    return ElevationModel(heights.astype(np.float32), resolution_m, origin)


def _read_raw(path: Path, origin: Pose2) -> ElevationModel:
    """Keys: ``size`` (one number or [rows, columns]), ``format``, ``metresPerPixel`` or, apart for rows and
    columns, ``metresPerPixelLat`` and ``metresPerPixelLon``; ``elevationMin`` and ``elevationMax`` for whole
    numbers that stand for the part in between; ``file``, else the same name ending in .bin.
    """
    side = read_json(path, "a JSON side file")
    if not isinstance(side, dict):
        raise InputError(f"{path}: expected an object with size and format, found another value")
    size = side.get("size")
    shape = [size, size] if isinstance(size, int) else size
    if not (isinstance(shape, list) and len(shape) == 2 and all(type(n) is int and n > 1 for n in shape)):
        raise InputError(
            f"{path}: size: expected a number or [rows, columns] above 1, found {str(size)[:40]}"
        )
    rows, columns = shape
    name = side.get("format")
    if not isinstance(name, str) or name not in FORMATS:
        raise InputError(f"{path}: format: expected one of {', '.join(FORMATS)}, found {name!r}")
    dtype = np.dtype(FORMATS[name])
    row_m = _positive(side, "metresPerPixelLat", path)
    column_m = _positive(side, "metresPerPixelLon", path)
    require_memory(12 * rows * columns, f"{path}: an elevation model of {columns} x {rows} cells")
    raw = path.parent / side["file"] if isinstance(side.get("file"), str) else path.with_suffix(".bin")
    data = read_bytes(raw, f"the array of '{path}'")
    held = len(data)
    if held != rows * columns * dtype.itemsize:
        raise InputError(
            f"{raw}: expected {rows * columns * dtype.itemsize} bytes for {columns} x {rows} values, "
            f"found {held}; the file seems to be cut short or of another size"
        )
    heights = quiet(np.frombuffer(data, dtype=dtype).reshape(rows, columns)).astype(np.float32)
    if "elevationMin" in side or "elevationMax" in side:
        low, high = _number(side, "elevationMin", path), _number(side, "elevationMax", path)
        whole = np.iinfo(dtype).max if dtype.kind in "iu" else 1.0
        heights = np.float32(low) + heights * np.float32((high - low) / whole)
    return _squared(heights, row_m, column_m, origin)


def _number(side: dict[str, Any], key: str, path: Path) -> float:
    value = side.get(key)
    # Compared first: JSON's whole numbers may be too long for a float.
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e30:
        raise InputError(f"{path}: {key}: expected a number, found {str(value)[:40]}")
    return float(value)


def _positive(side: dict[str, Any], key: str, path: Path) -> float:
    key = key if key in side else "metresPerPixel"
    value = _number(side, key, path)
    if value <= 0.0:
        raise InputError(f"{path}: {key}: expected a resolution above 0 m, found {value}")
    return value


def _read_ascii(path: Path, origin: Pose2 | None) -> ElevationModel:
    grid = read_ascii_grid(path)
    with np.errstate(over="ignore"):  # what becomes infinite is refused
        heights = grid.values.astype(np.float32)
    corner = Pose2(*grid.corner_m, 0.0) if origin is None else origin
    return _squared(heights, grid.row_m, grid.column_m, corner)


def _read_geotiff(path: Path, origin: Pose2 | None) -> ElevationModel:
    """The first band; the cells' size in the file's own units, which have to be metres."""
    try:
        import rasterio
    except ImportError:
        raise missing(
            f"elevation '{path}': GeoTIFF needs rasterio (or gdal_translate -of AAIGrid, which makes "
            "an .asc of it), which is not installed",
            "terrain",
        ) from None
    try:
        # Its other drivers follow what a file says to other files, on the network too.
        with rasterio.open(path, driver="GTiff") as source:
            size = 12 * source.width * source.height
            if size > limit(MOST_BYTES):
                raise too_large(
                    f"elevation '{path}' ({source.width} x {source.height})", limit(MOST_BYTES), size
                )
            require_memory(12 * source.width * source.height, f"elevation '{path}'")
            band = source.read(1, masked=True).astype(np.float32)
            place = source.transform
            south = min(place.f, place.f + place.e * source.height)
            corner = Pose2(float(min(place.c, place.c + place.a * source.width)), float(south), 0.0)
            column_m, row_m = abs(place.a), abs(place.e)
            turned = place.b != 0.0 or place.d != 0.0 or place.a < 0.0
            upside_down = place.e > 0.0
            crs = source.crs
            geographic = crs is not None and crs.is_geographic
            metres = crs is None or not crs.is_projected or crs.linear_units_factor[1] == 1.0
    except rasterio.errors.RasterioError as error:
        raise InputError(f"elevation '{path}': cannot be read ({error})") from None
    if geographic:
        raise InputError(f"elevation '{path}': expected metres, found degrees; project it first (gdalwarp)")
    if turned:
        raise InputError(f"elevation '{path}': expected rows that run east, found turned ones; gdalwarp it")
    if not metres:
        raise InputError(
            f"elevation '{path}': expected metres, found {crs.linear_units}; project it (gdalwarp)"
        )
    heights = quiet(np.asarray(band.filled(np.nan), dtype=np.float32))
    if upside_down:
        heights = heights[::-1]
    return _squared(heights, row_m, column_m, corner if origin is None else origin)


def _squared(heights: HeightArray, row_m: float, column_m: float, origin: Pose2) -> ElevationModel:
    """Stretch the rows linearly until the cells are square."""
    if math.isclose(row_m, column_m, rel_tol=1e-9):
        return ElevationModel(heights, row_m, origin)
    rows, columns = heights.shape
    count = max(2, round(columns * column_m / row_m))
    if 12 * rows * count > limit(MOST_BYTES):
        raise too_large(
            f"an elevation model stretched to {count} x {rows} square cells",
            limit(MOST_BYTES),
            12 * rows * count,
        )
    require_memory(12 * rows * count, f"an elevation model stretched to {count} x {rows} square cells")
    at = np.clip((np.arange(count) + 0.5) * row_m / column_m - 0.5, 0.0, columns - 1.0)
    left = np.minimum(at.astype(np.int64), columns - 2)
    part = (at - left).astype(np.float32)
    stretched = heights[:, left] * (1.0 - part) + heights[:, left + 1] * part
    return ElevationModel(np.asarray(stretched, dtype=np.float32), row_m, origin)
