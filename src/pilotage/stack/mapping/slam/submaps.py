"""Submaps: a few metres of path each, large enough to be told from its likes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.frames import gathered
from pilotage.kernels.slam.match_grid import ScoreArray, Scores, score_grid, scores_of
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.uncertainty import relative_poses

TURN_AS_PATH_M = 0.3
"""Path that a turn of one radian counts as."""
RANGE_M = 12.0
"""Points farther from where they were seen are left out: they are few, and off by much where a heading is."""
STD_M, OPEN_SCORE = 0.12, -0.4
MARGIN_M = 0.5
LEVELS = 5
T = TypeVar("T")
KEPT_SCORES, KEPT_SUBMAPS = 2, 512
"""A submap is an eighth of a megabyte. Each round of closures looks at all of a building's again: where fewer
are kept, most are drawn again at each look, a sixth of the time that a map takes."""


@dataclass(frozen=True, slots=True)
class Extent:
    """Keyframes ``first`` to ``last`` of a submap, whose frame is that of keyframe ``reference``.

    ``piece`` counts the breaks of the track before it.
    """

    first: int
    last: int
    reference: int
    piece: int = 0


@dataclass(frozen=True, slots=True)
class Submap:
    """One submap in its reference keyframe's frame.

    Attributes
    ----------
    grid
        Scores of ``score_grid``, and ``corner_xy_m`` (2,) the corner of its lower-left cell.
    coarse, fine
        (K, 6) points thinned for the search and for the alignment.
    """

    grid: ScoreArray
    corner_xy_m: FloatArray
    coarse: FloatArray
    fine: FloatArray


def path_lengths(poses: FloatArray) -> FloatArray:
    """(K,) path up to each of the keyframes (K, 3), turns counting as TURN_AS_PATH_M has it."""
    moved = relative_poses(poses[:-1], poses[1:])
    steps = np.hypot(moved[:, 0], moved[:, 1]) + TURN_AS_PATH_M * np.abs(moved[:, 2])
    return np.concatenate([[0.0], np.cumsum(steps)])


def extents(poses: FloatArray, length_m: float, breaks: IntArray) -> list[Extent]:
    """Cut the path of keyframes (K, 3) into stretches that overlap by half, none of them across a break."""
    path = path_lengths(poses)
    bounds = [0, *breaks.tolist(), poses.shape[0]]
    out = []
    for piece, (start, end) in enumerate(pairwise(bounds)):
        cuts = [start]
        while cuts[-1] < end - 1:
            after = int(np.searchsorted(path, path[cuts[-1]] + 0.5 * length_m))
            cuts.append(min(max(after, cuts[-1] + 1), end - 1))
        if len(cuts) < 3:
            out.append(Extent(start, end - 1, (start + end - 1) // 2, piece))
        else:
            both = zip(cuts[:-2], cuts[2:], strict=True)
            out += [Extent(first, last, (first + last) // 2, piece) for first, last in both]
    return out


def thinned(points: FloatArray, cell_m: float) -> FloatArray:
    """Keep the first point (K, 6) of every square cell."""
    cells = np.floor(points[:, :2] / cell_m).astype(np.int64)
    _, first = np.unique(cells[:, 0] * 4_000_037 + cells[:, 1], return_index=True)
    return np.ascontiguousarray(points[np.sort(first)])


def drawn(clouds: Clouds, poses: FloatArray, chosen: IntArray, frame: FloatArray, cell_m: float) -> Submap:
    """Draw some keyframes (C,), of all whose poses are (K, 3), in a frame (3,)."""
    points = gathered(clouds.points, clouds.starts, chosen, poses, frame)
    origins = relative_poses(np.repeat(frame[None], chosen.size, axis=0), poses[chosen])[:, :2]
    counts = np.diff(clouds.starts)[chosen]
    owner = np.repeat(np.arange(chosen.size), counts)
    near = np.hypot(*(points[:, :2] - origins[owner]).T) < RANGE_M
    points, counts = points[near], np.bincount(owner[near], minlength=chosen.size)
    if points.shape[0] == 0:
        empty = np.zeros((1, 1), np.float32)
        return Submap(empty, origins[0], points, points)
    low, high = points[:, :2].min(axis=0) - MARGIN_M, points[:, :2].max(axis=0) + MARGIN_M
    grid = score_grid(
        np.ascontiguousarray(points[:, :2]),
        np.ascontiguousarray(origins),
        counts,
        np.concatenate([low, high]),
        cell_m,
        STD_M,
        OPEN_SCORE,
    )
    return Submap(grid, low, thinned(points, 2.0 * cell_m), thinned(points, 0.05))


class Submaps:
    """All submaps of a track, drawn when they are asked for; what was not used lately is forgotten."""

    def __init__(self, config: SlamConfig) -> None:
        self.extents: list[Extent] = []
        self.references: IntArray = np.zeros(0, np.int64)
        self.pieces: IntArray = np.zeros(0, np.int64)
        self.cell_m = config.search_cell_m
        self._length_m = config.submap_length_m
        self._clouds, self._local = Clouds.of([]), np.zeros((0, 3))
        self._drawn: OrderedDict[int, Submap] = OrderedDict()
        self._scores: OrderedDict[int, Scores] = OrderedDict()

    def grow(self, clouds: Clouds, local: FloatArray, breaks: IntArray, ended: bool = True) -> None:
        """Cut a track that has grown; what is drawn of it stays, for the front end moves no keyframe.

        Parameters
        ----------
        clouds, local, breaks
            Of all keyframes, their poses (K, 3) by the front end, and where it broke.
        ended
            Whether the last submap, which may be a short one, counts already.
        """
        self.lay(clouds, local, extents(local, self._length_m, breaks)[: None if ended else -1])

    def lay(self, clouds: Clouds, local: FloatArray, extents: list[Extent]) -> None:
        """Take submaps that are cut already, of keyframes at poses (K, 3)."""
        before, self.extents = self.extents, extents
        for index, extent in enumerate(before):
            if index >= len(self.extents) or self.extents[index] != extent:
                self._drawn.pop(index, None)
                self._scores.pop(index, None)
        self.references = np.array([extent.reference for extent in self.extents], np.int64)
        self.pieces = np.array([extent.piece for extent in self.extents], np.int64)
        self._clouds, self._local = clouds, local

    def forget(self) -> None:
        """Let go of what is drawn; it is drawn again when it is asked for."""
        self._drawn.clear()
        self._scores.clear()

    def __len__(self) -> int:
        return len(self.extents)

    def __getitem__(self, index: int) -> Submap:
        return _kept(self._drawn, index, self._draw, KEPT_SUBMAPS)

    def _draw(self, index: int) -> Submap:
        extent = self.extents[index]
        chosen = np.arange(extent.first, extent.last + 1)
        return drawn(self._clouds, self._local, chosen, self._local[extent.reference], self.cell_m)

    def scores(self, index: int) -> Scores:
        """For the search in a submap."""
        return _kept(self._scores, index, self._score, KEPT_SCORES)

    def _score(self, index: int) -> Scores:
        submap = self[index]
        return scores_of(submap.grid, LEVELS, submap.corner_xy_m, self.cell_m)


def _kept(store: OrderedDict[int, T], index: int, make: Callable[[int], T], most: int) -> T:
    """One of those that are kept, made where it is not among them; so many at most, the last used ones."""
    if index not in store:
        store[index] = make(index)
        while len(store) > most:
            store.popitem(last=False)
    store.move_to_end(index)
    return store[index]
