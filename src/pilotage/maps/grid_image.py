"""Grey images as arrays and as grid maps: PNG, PGM, and whatever else Pillow reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pilotage.core.errors import InputError
from pilotage.core.files.images import pixel_bytes
from pilotage.core.types import Pose2
from pilotage.maps.image_file import opened_image
from pilotage.maps.occupancy_grid import CORNER, FREE, OCCUPIED, OccupancyGrid

ByteArray = NDArray[np.uint8]
GreyArray = NDArray[np.uint8] | NDArray[np.uint16]
"""Lightness from 0 to what the type can hold."""

GEOTIFF = frozenset({".tif", ".tiff"})
IMAGES = frozenset({".png", ".pgm", ".pbm", ".bmp", ".jpg", ".jpeg"}) | GEOTIFF
WHITE_FROM = 128
DEEPEST = 65535
STEP = 257
"""What 8 bits become in 16: 255 and 65535 are both white."""
NEARLY_GREY = 8
"""Of 255: by how much a pixel's red, green and blue may differ, as palettes and smoothed edges of grey
drawings do. Of what is more coloured map servers do not agree how dark it is."""


def read_grey(path: Path, size: tuple[int, int] | None = None) -> tuple[GreyArray, ByteArray | None]:
    """Read an image whose colours are all grey, or nearly, of up to 16 bits a pixel.

    Parameters
    ----------
    size
        Rows and columns that it has to have.

    Returns
    -------
    grey, alpha
        (rows, columns) each; alpha is None where the image has none. Grey has 8 bits wherever they say all.

    Raises
    ------
    InputError
        Where the image is missing, unreadable, coloured, of another depth or size, or too large.
    """
    with opened_image(path, size, lambda image: 2 * pixel_bytes(image) + 1) as image:
        return _grey(image, path)


def as_bytes(grey: GreyArray) -> ByteArray:
    """The same picture with 8 bits a pixel, rounded."""
    if grey.dtype == np.uint8:
        return np.asarray(grey, dtype=np.uint8)
    return np.asarray((grey.astype(np.uint32) + STEP // 2) // STEP, dtype=np.uint8)


def _grey(image: Image.Image, path: Path) -> tuple[GreyArray, ByteArray | None]:
    # Pillow reads 16 bits of a PNG or PGM into 32; those of a TIFF with 32 have no white.
    if image.mode.startswith("I;16") or (image.mode == "I" and image.format in ("PNG", "PPM")):
        return _deep(image), None
    if image.mode == "P" or (image.mode in ("1", "L", "RGB") and "transparency" in image.info):
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    if image.mode == "1":
        image = image.convert("L")
    if image.mode not in ("L", "LA", "RGB", "RGBA"):
        raise InputError(
            f"image '{path}': expected grey pixels of 8 or 16 bits, found mode {image.mode}; convert it"
        )
    array = np.asarray(image)
    if array.ndim == 2:
        return array, None
    colours = array[..., : 3 if image.mode.startswith("RGB") else 1]
    if (colours.max(-1) - colours.min(-1) > NEARLY_GREY).any():
        raise InputError(f"image '{path}': expected grey pixels, found coloured ones; convert it to grey")
    channels = colours.shape[-1]
    grey = ((colours.sum(-1, dtype=np.uint16) + channels // 2) // channels).astype(np.uint8)
    return grey, np.ascontiguousarray(array[..., -1]) if image.mode.endswith("A") else None


def _deep(image: Image.Image) -> GreyArray:
    """16 bits, or 8 where that loses nothing."""
    grey = np.asarray(image).astype(np.uint16)
    if (grey % STEP).any():
        return grey
    grey //= STEP
    return grey.astype(np.uint8)


def write_grey(path: Path, grey: GreyArray, alpha: ByteArray | None = None) -> None:
    """Write an image without loss; by suffix ``.pgm`` (which holds no alpha) or ``.png``.

    Raises
    ------
    InputError
        For another suffix, and for alpha in a PGM file.
    """
    if path.suffix.lower() not in (".png", ".pgm"):
        raise InputError(f"image '{path}': expected a name ending in .png or .pgm; others may lose something")
    if alpha is not None and path.suffix.lower() == ".pgm":
        raise InputError(f"image '{path}': PGM holds no transparency; take .png")
    image = Image.fromarray(grey)
    if alpha is not None:
        image = Image.merge("LA", (image, Image.fromarray(alpha)))
    # PNG loses nothing at any level; the default takes five times as long.
    image.save(path, compress_level=1)


def read_hazard_image(path: Path, resolution_m: float, origin: Pose2 = CORNER) -> OccupancyGrid:
    """Read an obstacle map where white is an obstacle and black is free ground.

    Raises
    ------
    InputError
        As ``read_grey``, and for a resolution that is not above 0.
    """
    grey, _ = read_grey(path)
    cells = np.where(as_bytes(grey) >= WHITE_FROM, np.int8(OCCUPIED), np.int8(FREE))
    return OccupancyGrid(cells, resolution_m, origin)
