"""A map of walls from a grid: the outlines of its occupied cells, as few segments as a tolerance allows."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.shown import shown
from pilotage.core.types import FloatArray
from pilotage.core.whole_file import write_whole
from pilotage.maps.map_file import MOST_PARTS
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.outlines import outlines

Bounds = tuple[float, float, float, float]

_LEAST_CELL_M = 1e-6
"""A wall map's numbers are written to a tenth of it: walls along smaller cells would have no length there."""


def wall_segments(grid: OccupancyGrid, tolerance_m: float = 0.0) -> FloatArray:
    """(N, 4) x0, y0, x1, y1 of the walls in the map frame.

    Sides in one line are one segment. With a tolerance the staircases of slanted walls become straight:
    closed outlines are thinned so that no corner lies farther than it from what stands in its place (Douglas
    and Peucker 1973). A wall as thin as the tolerance may become a single line.

    Raises
    ------
    InputError
        Where nothing is occupied, cells are smaller than a micrometre, or the tolerance is no length.
    """
    if not (math.isfinite(tolerance_m) and tolerance_m >= 0.0):
        raise InputError(f"--tolerance: expected metres of 0 or more, found {tolerance_m:g}")
    if grid.resolution_m < _LEAST_CELL_M:
        raise InputError(
            f"vectorize: expected cells of at least {_LEAST_CELL_M:g} m, found {grid.resolution_m:g} m"
        )
    sides = outlines(grid)
    if not len(sides):
        raise InputError("vectorize: expected a map with occupied cells, found none; is the image negated?")
    if tolerance_m == 0.0:
        return sides
    found: list[FloatArray] = []
    for loop in _loops(sides, grid.resolution_m):
        kept = _thinned_loop(loop, tolerance_m)
        found.append(np.hstack([kept[:-1], kept[1:]]))
    segments = np.concatenate(found)
    return np.ascontiguousarray(segments[np.hypot(*(segments[:, 2:] - segments[:, :2]).T) > 0.0])


def write_wall_map(path: Path, name: str, segments_m: FloatArray, bounds_m: Bounds, source: str) -> None:
    """Write a map of walls that a mission, a planner and the wall filter take.

    Raises
    ------
    InputError
        Where there are more walls than such a map may have.
    """
    if len(segments_m) > MOST_PARTS:
        raise InputError(
            f"vectorize: expected at most {MOST_PARTS} walls, found {len(segments_m)}; "
            "take a larger --tolerance"
        )
    lines = [
        f"# Walls of {shown(source)}: the outlines of its occupied cells. Metres, x right, y up.",
        f"map: {name}",
        f"bounds_m: [{', '.join(_number(value) for value in bounds_m)}]",
        f"walls_count: {len(segments_m)}",
        "walls_m:",
        *(f"  - [{', '.join(_number(value) for value in wall)}]" for wall in segments_m.tolist()),
    ]
    write_whole(path, "\n".join(lines) + "\n")


def _number(value: float) -> str:
    """To a tenth of a micrometre: what is finer than that is rounding."""
    text = f"{value:.7f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if float(text) == 0.0 else text


def _loops(sides: FloatArray, resolution_m: float) -> list[FloatArray]:
    """Closed outlines (K, 2), the first corner once more at the end; every corner has two sides or four."""
    ends = sides.reshape(-1, 2)
    keys = [(int(x), int(y)) for x, y in np.round(ends / (1e-3 * resolution_m)).astype(np.int64)]
    numbers: dict[tuple[int, int], int] = {}
    node = [numbers.setdefault(key, len(numbers)) for key in keys]
    place = {number: ends[i] for i, number in enumerate(node)}
    beside: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for side in range(len(sides)):
        a, b = node[2 * side], node[2 * side + 1]
        beside[a].append((side, b))
        beside[b].append((side, a))
    used = [False] * len(sides)
    loops = []
    for first in range(len(sides)):
        if used[first]:
            continue
        begin, here = node[2 * first], node[2 * first + 1]
        used[first] = True
        corners = [begin, here]
        while here != begin:
            onward = next(((side, there) for side, there in beside[here] if not used[side]), None)
            if onward is None:  # a line that ends: kept as it is
                break
            used[onward[0]], here = True, onward[1]
            corners.append(here)
        loops.append(np.array([place[corner] for corner in corners]))
    return loops


def _thinned_loop(loop: FloatArray, tolerance_m: float) -> FloatArray:
    """A closed line in two halves, from its first corner to the farthest one and back."""
    far = int(np.argmax(np.hypot(*(loop - loop[0]).T)))
    if far in (0, len(loop) - 1):
        return loop[_kept(loop, tolerance_m)]
    halves = [half[_kept(half, tolerance_m)] for half in (loop[: far + 1], loop[far:])]
    return np.concatenate([halves[0], halves[1][1:]])


def _kept(line: FloatArray, tolerance_m: float) -> list[int]:
    """Corners that stay, by their numbers."""
    kept, waiting = {0, len(line) - 1}, [(0, len(line) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        a, edge = line[first], line[last] - line[first]
        inner = line[first + 1 : last] - a
        length = float(np.hypot(*edge))
        if length > 0.0:
            along = np.clip(inner @ edge / length**2, 0.0, 1.0)
            away = np.hypot(*(inner - along[:, None] * edge).T)
        else:
            away = np.hypot(*inner.T)
        farthest = int(np.argmax(away))
        if away[farthest] > tolerance_m:
            middle = first + 1 + farthest
            kept.add(middle)
            waiting += [(first, middle), (middle, last)]
    return sorted(kept)
