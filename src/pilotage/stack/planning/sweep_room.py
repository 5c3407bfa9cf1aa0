"""Where a sweep's path may lead: as far from walls as leaves nothing out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy

from pilotage.core.types import BoolArray
from pilotage.kernels.grids.distance import FAR, squared_distance
from pilotage.kernels.grids.travel_cost import travel_costs
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor, cell_side_m

CELLS = ((0.02, 1_000_000), (0.015, 4_000_000))
"""Side of the cells of paths and how many there may be, large floors take coarser ones; and where those leave
something out. A passage is found if it leaves the body 1.2 times their side on either side."""
SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)
"""How much of what is kept beyond the body's need is tried, one after the other."""
NEAR_WALLS = 3.0
"""What a metre costs beside what is open already, on the path to a part that is not."""


@dataclass(frozen=True)
class Keeping:
    """What a body needs around its centre, what it keeps of it where there is room, and where it starts."""

    radius_m: float
    clearance_m: float
    start_xy_m: tuple[float, float]


def path_floor(
    field: DistanceField, keeping: Keeping, width_m: float, told: Floor, cells: tuple[float, int]
) -> Floor:
    """Where the cells of a sweep's path are: they keep the clearance; where there is no room, what there is.

    The least is half a diagonal of a cell more than the body needs, as a line through cells' middles comes
    so much nearer to walls: cells are finer here than those that tell what is swept, of which the clearance
    keeps half a diagonal. Nobody keeps so much that what is beside a wall is out of a pass' reach, wherever
    cells of either kind begin: where only here and there one more is open a path has bends.

    Parameters
    ----------
    told
        The cells that are to be swept, and where those of a path begin; some lie nearer to walls than any of
        these.
    cells
        Their side, and how many there may be.
    """
    finest_m, most_cells = cells
    bounds_m, inside, radius_m, told_m = told.bounds_m, keeping.start_xy_m, keeping.radius_m, told.cell_m
    longest_m = max(bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1])
    cell_m = max(cell_side_m(bounds_m, min(finest_m, told_m), most_cells), longest_m / (FAR - 2))
    half_m = math.sqrt(0.5) * cell_m
    tight = Floor.of_field(
        field, bounds_m, radius_m + half_m, cell_m, inside, exact=True, most_cells=most_cells
    )
    reach_m = 0.5 * width_m - 1.5 * told_m
    beside_m = reach_m - half_m - 1.5 * cell_m
    more_m = min(keeping.clearance_m - radius_m + math.sqrt(0.5) * (told_m - cell_m), beside_m)
    if more_m <= 0.0:
        return tight
    levels = [tight.reachable & (tight.clearance_m >= tight.radius_m + share * more_m) for share in SHARES]
    start = tight.nearest_cell(np.array(inside), "the start")
    reach = reach_m / cell_m
    # Into a nook, and along a wall, the centre can come farther than lines through cells' middles lead.
    sought = tight.clearance_m >= radius_m
    row, column = tight.cells_of(told.middles(told.reachable))
    sought[row, column] = True
    sought &= _within(tight.reachable, reach)
    return replace(tight, reachable=_opened(levels, sought, start, reach))


def _opened(levels: list[BoolArray], sought: BoolArray, start: tuple[int, int], reach: float) -> BoolArray:
    """(rows, columns) the cells of the first of levels from which all is within reach, and the start's.

    Parameters
    ----------
    levels
        Cells (rows, columns) that keep less and less; the last are joined with one another.
    sought
        What is to be within reach, all of which is from the last.
    start
        Row and column of the start, a cell of the last level.
    reach
        As a number of cells: what is no farther from the path is swept by it. From a level only that is taken
        which reaches what those before do not, and what joins it to them.
    """
    opened = _largest(levels[0])
    for number, level in enumerate(levels):
        pieces, _ = scipy.ndimage.label(level | opened)
        joined = (pieces == pieces[_some_of(opened)]) if opened.any() else _largest(level)
        taken = opened | (joined & levels[0])
        for better in levels[1 : number + 1]:
            taken |= joined & better & _within(sought & ~_within(taken, reach), reach)
        taken[start] |= joined[start]
        opened = _with_paths(taken, joined, opened)
        if opened[start] and not (sought & ~_within(opened, reach)).any():
            break
    return opened


def _with_paths(taken: BoolArray, joined: BoolArray, opened: BoolArray) -> BoolArray:
    """Cells that were taken, all joined: with the best paths from each piece to what was open before."""
    home = _some_of(opened if opened.any() else _largest(taken))
    factor = np.where(taken, 1.0, np.where(joined, NEAR_WALLS, np.inf))
    pieces, count = scipy.ndimage.label(taken)
    if count < 2:
        return taken
    columns = factor.shape[1]
    cost, parent = travel_costs(factor, home[0] * columns + home[1], 1.0, 1.0)
    path: BoolArray = np.zeros_like(taken)
    for piece in range(1, count + 1):
        node = int(np.argmin(np.where(pieces.ravel() == piece, cost, np.inf)))
        while node >= 0 and not path.flat[node]:
            path.flat[node] = True
            node = int(parent[node])
    # A diagonal step needs both cells beside it.
    return np.asarray(taken | (joined & scipy.ndimage.binary_dilation(path)))


def _within(cells: BoolArray, reach: float) -> BoolArray:
    """Cells that are within reach of such; none of nothing."""
    return np.asarray(squared_distance(np.ascontiguousarray(cells)) <= reach**2)


def _largest(cells: BoolArray) -> BoolArray:
    """The largest piece of them; nothing of nothing."""
    pieces, _ = scipy.ndimage.label(cells)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(cells & (pieces == np.argmax(sizes)))


def _some_of(cells: BoolArray) -> tuple[int, int]:
    """Row and column of one of them."""
    row, column = np.unravel_index(int(np.argmax(cells)), cells.shape)
    return int(row), int(column)
