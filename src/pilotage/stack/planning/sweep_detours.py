"""What a sweep leaves of a floor, and detours to it."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.maps.floor import Floor
from pilotage.stack.planning.sweep_floor import Sought, covered

DETOUR_ROUNDS = 6
MOST_PAIRS, MOST_LEFT, MOST_STANDS = 10_000_000, 1_000, 5_000
"""Cells to be swept times places to sweep them from that are weighed; where there are more, some of either in
turn: what the others need is found in the next round."""


def completed(sought: Sought, path: FloatArray) -> FloatArray:
    """(N, 2) the path with detours to what it leaves of a floor, through the inner one."""
    floor, inner, width_m = sought.floor, sought.inner, sought.width_m
    for _ in range(DETOUR_ROUNDS):
        missing = sought.must & ~covered(floor, path, width_m)
        places = _places_for(sought, path, missing)
        if len(places) == 0:
            break
        path = _with_detours(inner, path, places)
    return path


def joined(floor: Floor, here: FloatArray, there: FloatArray) -> FloatArray:
    """(K, 2) a path between two places: straight where nothing is in the way."""
    if floor.is_clear(here, there):
        return np.array([here, there])
    (path,) = floor.paths_m(there, here[None])
    return np.vstack([here, path[::-1][1:-1], there])


def _places_for(sought: Sought, path: FloatArray, missing: BoolArray) -> FloatArray:
    """(K, 2) places for the centre that together sweep what is missing, piece by piece, near to the path."""
    floor, inner, reach_m = sought.floor, sought.inner, 0.5 * sought.width_m
    on_path = np.zeros_like(inner.reachable)
    mark_swept(np.ascontiguousarray(path), 0.71 * inner.cell_m, *inner.origin_xy_m, inner.cell_m, on_path)
    away_m = inner.cell_m * scipy.ndimage.distance_transform_edt(~on_path)
    found = []
    for left in _pieces(floor, missing, sought.width_m):
        low, high = (
            np.array(inner.cell_of(end)) for end in (left.min(axis=0) - reach_m, left.max(axis=0) + reach_m)
        )
        window = slice(low[0], high[0] + 1), slice(low[1], high[1] + 1)
        cells = np.argwhere(inner.reachable[window])
        stand = np.array(inner.origin_xy_m) + (cells + low + 0.5)[:, ::-1] * inner.cell_m
        worth = 1.0 / (0.5 * reach_m + away_m[window][tuple(cells.T)])
        if len(stand) * len(left) > MOST_PAIRS:
            left = left[:: math.ceil(len(left) / MOST_LEFT)]
            some = _some_of(stand, left)
            stand, worth = stand[some], worth[some]
        near = ((stand[:, None] - left[None]) ** 2).sum(axis=2) <= reach_m**2
        while near.any():
            # What is swept by a metre of detour.
            best = int(np.argmax(near.sum(axis=1) * worth))
            found.append(stand[best])
            near[:, near[best]] = False
    return np.array(found).reshape(-1, 2)


def _some_of(stand: FloatArray, left: FloatArray) -> IntArray:
    """Indices of places (N, 2): some of all, and for each point (M, 2) the one that is nearest to it."""
    _, nearest = scipy.spatial.cKDTree(stand).query(left)
    return np.union1d(np.arange(0, len(stand), math.ceil(len(stand) / MOST_STANDS)), nearest)


def _pieces(floor: Floor, missing: BoolArray, width_m: float) -> list[FloatArray]:
    """(K, 2) middles of the cells of each piece, in tiles of a width where it is larger than two."""
    pieces, _ = scipy.ndimage.label(missing, structure=np.ones((3, 3)))
    side = math.ceil(width_m / floor.cell_m)
    tiles = (
        np.arange(missing.shape[0])[:, None] // side * missing.shape[1] + np.arange(missing.shape[1]) // side
    )
    out = []
    for piece, window in enumerate(scipy.ndimage.find_objects(pieces), start=1):
        cells = np.zeros_like(missing)
        cells[window] = pieces[window] == piece
        if max(cells[window].shape) <= 2 * side:
            out.append(floor.middles(cells))
            continue
        where = tiles[cells]
        middles = floor.middles(cells)
        out += [middles[where == tile] for tile in np.unique(where)]
    return out


def _with_detours(floor: Floor, path: FloatArray, places: FloatArray) -> FloatArray:
    """The path by way of further places: there and back from where it comes nearest to each in sight.

    Where none of it is in sight the nearest may lie behind a wall: what is nearest by the floor counts.
    """
    for place in places:
        a, step = path[:-1], np.diff(path, axis=0)
        share = ((place - a) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12)
        foot = a + np.clip(share, 0.0, 1.0)[:, None] * step
        there_m = np.hypot(*(foot - place).T)
        near = np.argsort(there_m, kind="stable")[:30].tolist()
        seen = next((k for k in near if floor.is_clear(foot[k], place)), None)
        k = _nearest_by_floor(floor, foot, place) if seen is None else seen
        out = joined(floor, foot[k], place) if seen is None else np.vstack([foot[k], place])
        path = np.insert(path, k + 1, np.vstack([out, out[-2::-1]]), axis=0)
    return path


def _nearest_by_floor(floor: Floor, points: FloatArray, place: FloatArray) -> int:
    """Which of points (N, 2) has the shortest path to a place."""
    away = floor.costs_from(place).reshape(floor.reachable.shape)
    return int(np.argmin(away[floor.cells_of(points)]))
