"""From landmarks to cells: which cells boxes stand in and tapes cross.

A wall marks the cells just behind its face; where two walls nearly meet, they meet. A tape reaches as far as
line sensors saw it: half-way from the last dark sample along it to the first bright one.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import BoolArray, FloatArray
from pilotage.maps.cell_map import CellMap, CellState
from pilotage.maps.true_cells import length_inside
from pilotage.stack.localization.line_map import Kind, LineMap
from pilotage.stack.mapping.sheet_grid import SheetGrid, SheetShape

WALL_CORNER_M, TAPE_CORNER_M = 0.045, 0.11
"""How far apart two walls, or two tapes, may end and still be taken to meet."""
BEHIND_M = 0.001
"""A box less than this far into a cell is left out of it."""


def joined_extents(landmarks: LineMap, kind: Kind, reach_m: float) -> dict[int, tuple[float, float]]:
    """Extents of the landmarks of one kind, prolonged or cut to where they meet another."""
    own = landmarks.of_kind(kind)
    return {j: (_joined(landmarks, j, 0, own, reach_m), _joined(landmarks, j, 1, own, reach_m)) for j in own}


def _joined(landmarks: LineMap, j: int, end: int, others: list[int], reach_m: float) -> float:
    """Where one end of a landmark lies along it."""
    angle, offset, x, y = landmarks.lines[j]
    tangent = np.array([-math.sin(angle), math.cos(angle)])
    foot = np.array([x + offset * math.cos(angle), y + offset * math.sin(angle)])
    seen = float(landmarks.extents[j, end])
    best, at = reach_m, seen
    for i in others:
        angle_i, offset_i, x_i, y_i = landmarks.lines[i]
        normal = np.array([math.cos(angle_i), math.sin(angle_i)])
        slope = float(tangent @ normal)
        if i == j or abs(slope) < 0.3:
            continue
        along = (offset_i - float((foot - (x_i, y_i)) @ normal)) / slope
        meeting = foot + along * tangent - (x_i, y_i)
        along_i = normal[0] * meeting[1] - normal[1] * meeting[0]
        low, high = landmarks.extents[i]
        if low - reach_m < along_i < high + reach_m and abs(along - seen) < best:
            best, at = abs(along - seen), along
    return at


def obstacle_cells(landmarks: LineMap, shape: SheetShape) -> BoolArray:
    """(rows, columns) cells behind the walls."""
    cells = np.zeros((shape.rows, shape.columns), np.bool_)
    for j, (low, high) in joined_extents(landmarks, Kind.WALL, WALL_CORNER_M).items():
        angle = float(landmarks.lines[j, 0])
        behind = BEHIND_M * np.array([math.cos(angle), math.sin(angle)])
        if high - low > 2.0 * BEHIND_M:
            ends = landmarks.segment(j, low + BEHIND_M, high - BEHIND_M) - behind
            cells |= length_inside(ends, *shape.edges_m) > 0.0
    return cells


def line_cells(landmarks: LineMap, samples: FloatArray, tape_width_m: float, shape: SheetShape) -> BoolArray:
    """(rows, columns) cells that the tapes' centre lines cross.

    Parameters
    ----------
    samples
        (M, 3) x, y on the map and 1 where a line sensor read dark there.
    """
    cells = np.zeros((shape.rows, shape.columns), np.bool_)
    for low, high, j in _tapes(landmarks, samples, tape_width_m):
        cells |= length_inside(landmarks.segment(j, low, high), *shape.edges_m) > 0.0
    return cells


def _tapes(landmarks: LineMap, samples: FloatArray, tape_width_m: float) -> list[tuple[float, float, int]]:
    """Each tape's extent: joined to others, else as far as it was seen."""
    grown: dict[int, tuple[float, float]] = {}
    for j in landmarks.of_kind(Kind.TAPE):
        off, along = _along(landmarks, j, samples)
        near = np.abs(off) < 0.4 * tape_width_m
        dark = samples[:, 2] > 0.0
        low, high = landmarks.extents[j]
        grown[j] = (
            -_seen_until(-low, -along[near & dark], -along[near & ~dark]),
            _seen_until(high, along[near & dark], along[near & ~dark]),
        )
        landmarks.extents[j] = grown[j]
    joined = joined_extents(landmarks, Kind.TAPE, TAPE_CORNER_M)
    result = []
    for j, (low, high) in joined.items():
        off, along = _along(landmarks, j, samples)
        near = np.abs(off) < 0.4 * tape_width_m
        bright = along[near & (samples[:, 2] == 0.0)]
        if low == landmarks.extents[j, 0]:
            low = -_half_way(-low, -bright)
        if high == landmarks.extents[j, 1]:
            high = _half_way(high, bright)
        result.append((float(low), float(high), j))
    return result


def _along(landmarks: LineMap, j: int, samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far samples lie off a landmark, and where along it."""
    angle, offset, x, y = landmarks.lines[j]
    nx, ny = math.cos(angle), math.sin(angle)
    dx, dy = samples[:, 0] - x, samples[:, 1] - y
    return nx * dx + ny * dy - offset, nx * dy - ny * dx


LONGEST_GAP_M = 0.09


def _seen_until(end: float, dark: FloatArray, bright: FloatArray) -> float:
    """Prolong an end by dark samples that follow it closely with no two bright ones before them."""
    for at in np.sort(dark[dark > end]):
        between = np.count_nonzero((bright > end + 0.002) & (bright < at - 0.002))
        if at - end > LONGEST_GAP_M or between > 1:
            break
        end = float(at)
    return end


def _half_way(end: float, bright: FloatArray) -> float:
    """Half-way to the first bright sample beyond an end, not farther than half a gap."""
    beyond = bright[bright > end]
    gap = float(beyond.min()) - end if beyond.shape[0] else LONGEST_GAP_M
    return end + 0.5 * min(gap, 0.7 * LONGEST_GAP_M)


def cell_map(grid: SheetGrid, obstacles: BoolArray, lines: BoolArray) -> CellMap:
    """The report's map: features over borders over what was visited over what was seen."""
    shape = grid.shape
    cells = CellMap.unknown(shape.rows, shape.columns)
    cells = cells.marked(grid.explored(), CellState.EXPLORED).marked(grid.visited, CellState.VISITED)
    cells = cells.marked(lines, CellState.LINE).marked(obstacles, CellState.OBSTACLE)
    return cells.marked(enclosed(cells), CellState.OBSTACLE).with_borders()


def enclosed(cells: CellMap) -> BoolArray:
    """(rows, columns) unknown cells with obstacles all around: the inside of boxes."""
    unknown = cells.holds(CellState.UNKNOWN)
    inside = unknown.copy()
    inside[[0, -1], :] = False
    inside[:, [0, -1]] = False
    open_side = ~cells.holds(CellState.OBSTACLE) & ~inside
    while True:
        beside = np.zeros_like(inside)
        beside[1:] |= open_side[:-1]
        beside[:-1] |= open_side[1:]
        beside[:, 1:] |= open_side[:, :-1]
        beside[:, :-1] |= open_side[:, 1:]
        leak = inside & beside
        if not leak.any():
            return inside
        inside &= ~leak
        open_side |= leak
