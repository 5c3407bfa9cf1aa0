"""Which of a map's pieces of floor are meant, and which lie outside of what it draws."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pilotage.core.types import BoolArray, IntArray

Labels = npt.NDArray[np.integer]
"""Of cells (rows, columns), from 1 on; 0 is no floor."""
OUTSIDE_RATIO = 1.5
"""Floor along more of the map's edge than so many roots of its own area lies outside."""
LEAST_SHARE = 0.1
"""What is smaller than this share of the largest piece is a shed in a yard rather than a house."""


def meant_piece(pieces: Labels, begun_on: int = 0) -> int:
    """The piece that is meant where nobody says: the largest that lies not outside. 0 where there is none.

    A robot's own map has its origin where it began to drive: the piece that it ``begun_on`` is meant, be it
    small, where it does not lie outside.

    A plan drawn askew or with a margin has floor around its walls as well, often more than between them: it
    runs along the map's edge. A hall or a corridor that the edge cuts off does so for less than
    ``OUTSIDE_RATIO`` times the root of its area. Fails where an open yard is meant that holds a closed house
    of more than ``LEAST_SHARE`` of its size: ``world.start`` tells.
    """
    sizes, lies_outside = _measured(pieces)
    if not sizes.any():
        return 0
    if begun_on and not lies_outside[begun_on]:
        return begun_on
    inside = ~lies_outside & _is_house(sizes)
    return int(np.argmax(np.where(inside, sizes, 0) if inside.any() else sizes))


def outside_of(pieces: Labels, home: int) -> BoolArray:
    """Which cells lie outside for who is in a piece; none for who is outside himself, or in a shed."""
    sizes, lies_outside = _measured(pieces)
    if lies_outside[home] or not _is_house(sizes)[home]:
        return np.zeros(pieces.shape, np.bool_)
    return np.asarray(lies_outside[pieces])


def _measured(pieces: Labels) -> tuple[IntArray, BoolArray]:
    """How large each piece is, in cells, and whether it lies outside."""
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    edge = np.concatenate([pieces[0], pieces[-1], pieces[1:-1, 0], pieces[1:-1, -1]])
    along = np.bincount(edge, minlength=len(sizes))
    along[0] = 0
    return sizes, along > OUTSIDE_RATIO * np.sqrt(sizes)


def _is_house(sizes: IntArray) -> BoolArray:
    return np.asarray((sizes > 0) & (sizes >= LEAST_SHARE * sizes.max()))
