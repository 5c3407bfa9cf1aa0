"""Which of a map's pieces of floor is meant where nobody says: the largest that does not lie outside."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

OUTSIDE_RATIO = 1.5
"""Floor along more of the map's edge than so many roots of its own area lies outside of what is drawn."""
LEAST_SHARE = 0.1
"""What is smaller than this share of the largest piece is a shed in a yard rather than a house."""


def meant_piece(pieces: npt.NDArray[np.integer], begun_on: int = 0) -> int:
    """The piece, of those that cells (rows, columns) are labelled with from 1 on; 0 where there is none.

    A robot's own map has its origin where it began to drive: the piece that it ``begun_on`` is meant, be it
    small, where it does not lie outside.

    A plan drawn askew or with a margin has floor around its walls as well, often more than between them: it
    runs along the map's edge. A hall or a corridor that the edge cuts off does so for less than
    ``OUTSIDE_RATIO`` times the root of its area. Fails where an open yard is meant that holds a closed house
    of more than ``LEAST_SHARE`` of its size: ``world.start`` tells.
    """
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    if not sizes.any():
        return 0
    edge = np.concatenate([pieces[0], pieces[-1], pieces[1:-1, 0], pieces[1:-1, -1]])
    along = np.bincount(edge, minlength=len(sizes))
    inside = along <= OUTSIDE_RATIO * np.sqrt(sizes)
    if begun_on and inside[begun_on]:
        return begun_on
    inside &= sizes >= math.ceil(LEAST_SHARE * sizes.max())
    return int(np.argmax(np.where(inside, sizes, 0) if inside.any() else sizes))
