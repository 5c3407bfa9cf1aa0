"""Image files of any size that memory allows, with one-line complaints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image, UnidentifiedImageError

from pilotage.core.errors import InputError
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
    if not path.is_file():
        raise InputError(f"image '{path}': expected an image there, found none")
    # Pillow guards against large images; here the memory that there is decides.
    limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
    try:
        with Image.open(path) as image:
            columns, rows = image.size
            if size is not None and (rows, columns) != size:
                raise InputError(
                    f"image '{path}': expected {size[1]} x {size[0]} pixels, found {columns} x {rows}"
                )
            require_memory(bytes_a_pixel(image) * rows * columns, f"image '{path}'")
            yield image
    except UnidentifiedImageError:
        raise InputError(
            f"image '{path}': expected a PNG, PGM or other image, found another format"
        ) from None
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(f"image '{path}': cannot be read ({error}); it may be cut short") from None
    finally:
        Image.MAX_IMAGE_PIXELS = limit
