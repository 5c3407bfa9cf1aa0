"""Light: what a change of exposure or lamps did to a frame, taken back by the paper's own colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STRIDE = 6


@dataclass(frozen=True, slots=True)
class Region:
    """The part of the reduced frames that holds the sheet.

    Attributes
    ----------
    rows, columns
        Slices of the frame.
    mask
        Where the sheet is, shape of the cut-out.
    """

    rows: slice
    columns: slice
    mask: Mask

    @classmethod
    def around(cls, corners: Floats, shape: tuple[int, int]) -> Region:
        """Cut out a quadrilateral, given in reduced pixels."""
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 3, shape[::-1])
        canvas = np.zeros((max(high[1] - low[1], 1), max(high[0] - low[0], 1)), np.uint8)
        outline = np.rint(corners - low).astype(np.int32)
        inside = opencv().fillConvexPoly(canvas, outline, 1).astype(np.bool_)
        return cls(slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])), inside)

    @property
    def offset(self) -> Floats:
        """Pixel of the reduced frame that is the cut-out's first, (x, y)."""
        return np.array([self.columns.start, self.rows.start], dtype=np.float64)

    def cut(self, image: Image) -> Image:
        """Return the region of a reduced frame."""
        return image[self.rows, self.columns]


def paper_colour(cut: Image, region: Region) -> Floats:
    """Median colour of the sheet: most of it is paper."""
    pixels = cut[::_STRIDE, ::_STRIDE][region.mask[::_STRIDE, ::_STRIDE]]
    return np.asarray(np.median(pixels, axis=0), dtype=np.float64) if len(pixels) else np.full(3, 128.0)


def in_light_of(cut: Image, region: Region, paper: Floats) -> Image:
    """Return a cut-out as it would look with the paper's colour as it was learned.

    A gain for each channel: exposure, white balance and lamps that change as a whole; not moving shadows.
    """
    gain = np.clip(paper / np.maximum(paper_colour(cut, region), 1.0), 0.25, 4.0)
    if np.abs(gain - 1.0).max() < 0.01:
        return cut
    table = np.clip(np.rint(np.arange(256)[:, None] * gain), 0, 255).astype(np.uint8)
    result: Image = opencv().LUT(cut, table.reshape(1, 256, 3))
    return result
