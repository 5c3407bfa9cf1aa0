"""From landmarks to cells: which cells boxes stand in and tapes cross.

A wall marks the cells just behind its face; where two walls nearly meet, they meet. A tape reaches as far as
line sensors saw it: half-way from the last dark sample along it to the first bright one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

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


def joined_extents(
    landmarks: LineMap, kind: Kind, reach_m: float, extents: FloatArray
) -> dict[int, tuple[float, float]]:
    """Extents of the landmarks of one kind, prolonged or cut to where they meet another."""
    own = landmarks.of_kind(kind)
    return {
        j: (
            _joined(landmarks, j, 0, own, reach_m, extents),
            _joined(landmarks, j, 1, own, reach_m, extents),
        )
        for j in own
    }


def _joined(
    landmarks: LineMap, j: int, end: int, others: list[int], reach_m: float, extents: FloatArray
) -> float:
    """Where one end of a landmark lies along it."""
    angle, offset, x, y = landmarks.lines[j]
    tangent = np.array([-math.sin(angle), math.cos(angle)])
    foot = np.array([x + offset * math.cos(angle), y + offset * math.sin(angle)])
    seen = float(extents[j, end])
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
        low, high = extents[i]
        if low - reach_m < along_i < high + reach_m and abs(along - seen) < best:
            best, at = abs(along - seen), along
    return float(at)


def obstacle_cells(landmarks: LineMap, shape: SheetShape) -> BoolArray:
    """(rows, columns) cells behind the walls."""
    cells = np.zeros((shape.rows, shape.columns), np.bool_)
    for j, (low, high) in joined_extents(landmarks, Kind.WALL, WALL_CORNER_M, landmarks.extents).items():
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
    for low, high in pairwise(tape_ends(landmarks, samples, tape_width_m)):
        if low.landmark == high.landmark:
            ends = landmarks.segment(low.landmark, low.middle_m, high.middle_m)
            cells |= length_inside(ends, *shape.edges_m) > 0.0
    return cells


@dataclass(frozen=True, slots=True)
class TapeEnd:
    """One end of a tape.

    Attributes
    ----------
    landmark, sign
        Which line, and -1 or 1 for its lower or upper end along it.
    at_m, bright_m
        Along the line: the outermost place where it was seen, and the first beyond where it was seen to be
        no more (as far as a gap may be, where that was never seen).
    joined
        Whether it meets another tape here; then both places are the corner.
    """

    landmark: int
    sign: int
    at_m: float
    bright_m: float
    joined: bool

    @property
    def middle_m(self) -> float:
        """The best guess of where it ends."""
        return 0.5 * (self.at_m + self.bright_m)


def tape_ends(landmarks: LineMap, samples: FloatArray, tape_width_m: float) -> list[TapeEnd]:
    """Both ends of each tape, lower and upper in turn; see ``line_cells``."""
    extents = landmarks.extents.copy()
    own = landmarks.of_kind(Kind.TAPE)
    bright_along = {}
    for j in own:
        off, along = _along(landmarks, j, samples)
        near, is_dark = np.abs(off) < 0.4 * tape_width_m, samples[:, 2] > 0.0
        dark, bright = along[near & is_dark], along[near & ~is_dark]
        low, high = extents[j]
        extents[j] = -_seen_until(-low, -dark, -bright), _seen_until(high, dark, bright)
        bright_along[j] = bright
    result = []
    for j, ends in joined_extents(landmarks, Kind.TAPE, TAPE_CORNER_M, extents).items():
        for end, sign in enumerate((-1, 1)):
            at, seen = ends[end], float(extents[j, end])
            if at != seen:
                result.append(TapeEnd(j, sign, at, at, joined=True))
                continue
            beyond = _first_beyond(sign * at, sign * bright_along[j])
            result.append(TapeEnd(j, sign, at, sign * beyond, joined=False))
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


def _first_beyond(end: float, bright: FloatArray) -> float:
    """The first bright sample beyond an end, not farther than a gap may be."""
    beyond = bright[bright > end]
    return min(float(beyond.min()), end + LONGEST_GAP_M) if beyond.shape[0] else end + LONGEST_GAP_M


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
