"""What is on the sheet: boxes and tapes, their edges by Canny and Hough, and the cells they take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.maps.cell_map import CellMap, CellState
from pilotage.tracking.channels import greatest_channel
from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv

Floats = NDArray[np.float64]

_UNLIKE_PAPER = 0.3
"""Distance from the paper's colour, over its brightness, of a box or a tape."""
_THIN = 0.012
"""Of the sheet's side: what is narrower than twice this is tape, what is wider a box."""
_SHORTEST = 0.03
"""Of the sheet's side: shorter tapes and edges are dirt."""
_LEAST_COVER = 0.03
"""Share of a cell that a box must take: a pixel's blur at its edge is not a box in the next cell."""
_LEAST_CROSSING = 0.08
"""Length of a tape inside a cell over the cell's side."""


@dataclass(frozen=True, slots=True)
class FloorMarks:
    """Boxes and tapes on the sheet.

    Attributes
    ----------
    cells
        OBSTACLE and LINE cells, the rest UNKNOWN.
    edges_m
        Straight edges found by the probabilistic Hough transform: x0, y0, x1, y1, shape (N, 4).
    is_tape
        Which of them belong to tapes; the others are edges of boxes. Shape (N,).
    """

    cells: CellMap
    edges_m: Floats
    is_tape: NDArray[np.bool_]


def find_marks(top_view: Image, paper: Floats, size_m: float, grid: int) -> FloorMarks:
    """Find boxes and tapes.

    Parameters
    ----------
    top_view
        The empty sheet from above, y up, square.
    paper
        Colour of the paper, BGR.
    size_m
        Side of the sheet.
    grid
        Cells along a side.
    """
    cv2 = opencv()
    side = top_view.shape[0]
    away = greatest_channel(np.abs(top_view.astype(np.float32) - paper.astype(np.float32)))
    marks = (away > _UNLIKE_PAPER * float(paper.mean())).astype(np.uint8)
    rim = max(2, round(0.004 * side))
    marks[:rim] = marks[-rim:] = 0
    marks[:, :rim] = marks[:, -rim:] = 0
    across = max(3, 2 * round(_THIN * side) + 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, across))
    boxes = cv2.morphologyEx(marks, cv2.MORPH_OPEN, kernel)
    # Opening rounds a box's corners: give them back from the marks themselves.
    boxes = cv2.bitwise_and(cv2.dilate(boxes, kernel), marks)
    tapes = _long_parts(cv2.bitwise_and(marks, 1 - boxes), _SHORTEST * side)
    cells = CellMap.unknown(grid, grid)
    cells = cells.marked(_per_cell(_ridge(tapes), grid) > _LEAST_CROSSING * side / grid, CellState.LINE)
    cells = cells.marked(_per_cell(boxes, grid) > _LEAST_COVER * (side / grid) ** 2, CellState.OBSTACLE)
    edges = hough_segments(cv2.Canny(cv2.cvtColor(top_view, cv2.COLOR_BGR2GRAY), 40, 120), side)
    on_tape, on_box = _touches(edges, tapes), _touches(edges, boxes)
    kept = on_tape | on_box
    metres = edges[kept].astype(np.float64) * size_m / (side - 1)
    metres[:, [1, 3]] = size_m - metres[:, [1, 3]]
    return FloorMarks(cells, metres, on_tape[kept] & ~on_box[kept])


def hough_segments(edges: Image, side: int) -> NDArray[np.int32]:
    """Straight segments in a picture of edges, shape (N, 4)."""
    found = opencv().HoughLinesP(
        edges,
        1.0,
        np.pi / 360.0,
        threshold=max(10, round(_SHORTEST * side)),
        minLineLength=_SHORTEST * side,
        maxLineGap=0.01 * side,
    )
    # OpenCV 4 returns shape (N, 1, 4), OpenCV 5 (N, 4), both None for nothing.
    return np.zeros((0, 4), np.int32) if found is None else np.asarray(found, np.int32).reshape(-1, 4)


def _long_parts(mask: Image, shortest: float) -> Image:
    cv2 = opencv()
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    extent = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    kept = extent >= shortest
    kept[0] = False
    return np.asarray(kept[labels], dtype=np.uint8) if count > 1 else np.zeros_like(mask)


def _ridge(tapes: Image) -> Image:
    """The middle of the tapes: one or two pixels wide."""
    cv2 = opencv()
    depth = cv2.distanceTransform(tapes, cv2.DIST_L2, 5)
    highest = cv2.dilate(depth, np.ones((3, 3), np.uint8))
    return np.asarray((depth > 0.0) & (depth >= highest - 1e-3), dtype=np.uint8)


def _per_cell(mask: Image, grid: int) -> Floats:
    """How many pixels of a top view fall into each cell, row 0 the smallest y."""
    rows, columns = np.nonzero(mask)
    height, width = mask.shape
    counts = np.zeros((grid, grid))
    np.add.at(counts, (((height - 1 - rows) * grid) // height, (columns * grid) // width), 1.0)
    return counts


def _touches(segments: NDArray[np.int32], mask: Image) -> NDArray[np.bool_]:
    """Which segments run along what the mask shows, for most of their length."""
    near = opencv().dilate(mask, np.ones((5, 5), np.uint8)) > 0
    share = np.linspace(0.1, 0.9, 9)
    x = np.rint(segments[:, [0]] + share * (segments[:, [2]] - segments[:, [0]])).astype(int)
    y = np.rint(segments[:, [1]] + share * (segments[:, [3]] - segments[:, [1]])).astype(int)
    return np.asarray(near[y, x].mean(axis=1) > 0.7)
