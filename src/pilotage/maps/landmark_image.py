"""Landmarks as coloured points on a grey picture of the ground."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.maps.image_file import opened_image
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.occupancy_grid import CORNER, OccupancyGrid

COLOURED_FROM = 48
"""Least difference of a pixel's greatest and least channel that is a colour, not a grey."""


def read_landmark_image(
    path: Path, resolution_m: float, origin: Pose2 = CORNER, size: tuple[int, int] | None = None
) -> Landmarks:
    """Take the coloured spots of an image as landmarks: one each, at its middle, numbered from the top.

    Spots that touch, over corners too, are one landmark.

    Parameters
    ----------
    size
        Rows and columns that it has to have.

    Raises
    ------
    InputError
        Where the image is missing, unreadable or of another size, or has no coloured spot.
    """
    with opened_image(path, size, lambda _: 12) as image:
        pixels = np.asarray(image.convert("RGB"))
    coloured = pixels.max(axis=2) - pixels.min(axis=2) >= COLOURED_FROM
    labels, count = scipy.ndimage.label(coloured, np.ones((3, 3), dtype=np.int64))
    if count == 0:
        raise InputError(f"image '{path}': expected landmarks as coloured points, found grey pixels only")
    middles = np.array(scipy.ndimage.center_of_mass(coloured, labels, np.arange(1, count + 1)))
    place = OccupancyGrid.of(np.zeros(coloured.shape, np.bool_), resolution_m, origin)
    return Landmarks(np.arange(count), place.centres_m(middles))
