"""Images: their header is looked at before a pixel is unpacked."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from pilotage.core.errors import InputError
from pilotage.core.files.plain import opened
from pilotage.core.files.words import in_words
from pilotage.core.hushed import hushed
from pilotage.core.limits import DATA_BYTES, limit, too_large

if TYPE_CHECKING:
    from PIL import Image

FORMATS = ("PNG", "PPM", "BMP", "TIFF", "JPEG")
"""Pillow knows more, some of which start other programs."""
_DAMAGED = (OSError, SyntaxError, ValueError, TypeError, LookupError, OverflowError, EOFError, MemoryError)


@contextmanager
def opened_image(path: Path, what: str = "an image") -> Iterator[Image.Image]:
    """Open an image whose pixels are within the limit; what fails while it is read is told as input, too.

    Raises
    ------
    InputError
        Where there is none, it is of another format, damaged, or too large.
    """
    from PIL import Image, UnidentifiedImageError

    where = f"image '{path}'"
    with opened(path, what, DATA_BYTES) as file, warnings.catch_warnings(), hushed():
        warnings.simplefilter("ignore")  # Pillow, and libtiff by itself, tell of damaged metadata
        # Pillow guards against large images by their pixels; here it is by their bytes, and told.
        guard, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            with Image.open(file, formats=FORMATS) as image:
                columns, rows = image.size
                size, most = columns * rows * pixel_bytes(image), limit(DATA_BYTES)
                if size > most:
                    raise too_large(f"{where} ({columns} x {rows} pixels)", most, size)
                yield image
        except UnidentifiedImageError:
            found = "another format" if file.seek(0, os.SEEK_END) else "an empty file"
            raise InputError(f"{where}: expected a PNG, PGM or other image, found {found}") from None
        except (*_DAMAGED, Image.DecompressionBombError) as error:
            raise InputError(f"{where}: cannot be read ({in_words(error)}); it may be cut short") from None
        finally:
            Image.MAX_IMAGE_PIXELS = guard


def pixel_bytes(image: Image.Image) -> int:
    """What Pillow takes for one pixel."""
    if image.mode in ("I", "F"):
        return 4
    return 2 if image.mode.startswith("I;16") else len(image.getbands())
