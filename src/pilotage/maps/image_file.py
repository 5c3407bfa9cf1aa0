"""Image files of any size that memory allows, with one-line complaints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from pilotage.core.errors import InputError
from pilotage.core.files import images as files
from pilotage.maps.memory import require_memory


@contextmanager
def opened_image(
    path: Path, size: tuple[int, int] | None, bytes_a_pixel: Callable[[Image.Image], int]
) -> Iterator[Image.Image]:
    """Open an image whose pixels fit into memory; what fails while it is read is told as input, too.

    Parameters
    ----------
    size
        Rows and columns that it has to have; None for any.
    bytes_a_pixel
        How much memory the caller will take for each pixel.

    Raises
    ------
    InputError
        Where the image is missing, unreadable, of another size, or too large.
    """
    with files.opened_image(path) as image:
        columns, rows = image.size
        if size is not None and (rows, columns) != size:
            raise InputError(
                f"image '{path}': expected {size[1]} x {size[0]} pixels, found {columns} x {rows}"
            )
        require_memory(bytes_a_pixel(image) * rows * columns, f"image '{path}'")
        yield image
