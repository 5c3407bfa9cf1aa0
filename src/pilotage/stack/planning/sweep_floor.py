"""What of a floor a sweep is for, and where its path may lead."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.geometry.field import sample_distance
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor, sweepable

FINE_CELLS = 12
"""Cells a width that tell what is swept; larger floors take coarser ones."""
FINEST_M = 0.02
"""Side of the cells of paths, larger on large floors: passages with less than this to spare may be missed."""
CORNER = 1.5
"""What keeps more from walls ends so much farther from a corner, in terms of the difference, or less."""
STEP_M = 0.002
"""Stretches of a trail on which its radius differs by less are taken together, with the least of it."""


@dataclass(frozen=True, eq=False)
class Sought:
    """What a sweep is for.

    Attributes
    ----------
    floor
        Where the robot's centre can be.
    inner
        Where the cells of its path are: as ``path_floor`` says; from the same corner on.
    must, may
        (rows, columns) cells of the floor to be swept, and those of its rim that may be left.
    width_m
        Of a pass.
    """

    floor: Floor
    inner: Floor
    must: BoolArray
    may: BoolArray
    width_m: float


@dataclass(frozen=True)
class Keeping:
    """What a body needs around its centre, what it keeps of it where there is room, and where it starts."""

    radius_m: float
    clearance_m: float
    start_xy_m: tuple[float, float]


def whole_floor(field: DistanceField, keeping: Keeping, width_m: float, overlap_m: float) -> Sought:
    """All of the floor, and the rim that only the body reaches."""
    radius_m, inside = keeping.radius_m, keeping.start_xy_m
    floor = Floor.of_field(field, field.bounds_m, radius_m, width_m / FINE_CELLS, inside)
    inner = path_floor(field, keeping, width_m)
    rim = sweepable(floor, width_m) & ~floor.reachable
    return Sought(floor, inner, floor.reachable, rim, width_m - overlap_m)


def rest_of(whole: Sought, trail: FloatArray, width_m: float, enough: float) -> Sought:
    """What a trail left of the floor, but for the least of it, and the rim beside that.

    Parameters
    ----------
    enough
        Share of the floor: the smallest pieces are left for good, down to this.
    """
    floor, swept = whole.floor, surely_covered(whole.floor, trail, width_m)
    must = _but_the_least(whole.must & ~swept, (1.0 - enough) * np.count_nonzero(whole.must))
    away_m = floor.cell_m * scipy.ndimage.distance_transform_edt(~must)
    return replace(whole, must=must, may=whole.may & ~swept & (away_m <= 0.5 * width_m))


def path_floor(field: DistanceField, keeping: Keeping, width_m: float) -> Floor:
    """Where the cells of a sweep's path are: they keep the clearance; where there is no room, what must be.

    The latter is half a diagonal of a cell more than the body needs, as a line through cells' middles comes
    so much nearer to walls: cells are finer here than those that tell what is swept, of which the former
    keeps half a diagonal. Nobody keeps so much that what is beside a wall is out of a pass' reach.
    """
    bounds_m, inside, radius_m = field.bounds_m, keeping.start_xy_m, keeping.radius_m
    told_m = Floor.of_field(field, bounds_m, radius_m, width_m / FINE_CELLS, inside).cell_m
    cell_m = Floor.of_field(field, bounds_m, radius_m, min(FINEST_M, told_m), inside).cell_m
    half_m = math.sqrt(0.5) * cell_m
    tight = Floor.of_field(_sampled_in(field, cell_m), bounds_m, radius_m + half_m, cell_m, inside)
    more_m = keeping.clearance_m - radius_m + math.sqrt(0.5) * (told_m - cell_m)
    more_m = min(more_m, 0.5 * width_m - 1.5 * told_m)
    if more_m <= 0.0:
        return tight
    wide = tight.reachable & (tight.clearance_m >= radius_m + more_m + half_m)
    band_m = CORNER * more_m + cell_m
    narrow = tight.reachable & (cell_m * scipy.ndimage.distance_transform_edt(~wide) > band_m)
    near = cell_m * scipy.ndimage.distance_transform_edt(~narrow) <= band_m + 2.0 * cell_m
    pieces, _ = scipy.ndimage.label(wide | (tight.reachable & near))
    both = replace(tight, reachable=pieces > 0)
    chosen = pieces == pieces[both.nearest_cell(np.array(inside), "the start")]
    # Where that cuts a part of the floor off, nothing is kept but what must be.
    cut_off = tight.reachable & (cell_m * scipy.ndimage.distance_transform_edt(~chosen) > 2.0 * band_m)
    return tight if cut_off.any() else replace(tight, reachable=chosen)


def _sampled_in(field: DistanceField, cell_m: float) -> DistanceField:
    """The field with nodes in cells' middles, where walls are known: coarser nodes miss doors' middles."""
    if len(field.segments_m) + len(field.circles_m) == 0:
        return field
    xmin, ymin, xmax, ymax = field.bounds_m
    x0, y0 = xmin + 0.5 * cell_m, ymin + 0.5 * cell_m
    size = math.ceil((xmax - xmin) / cell_m), math.ceil((ymax - ymin) / cell_m)
    walls = field.segments_m, field.circles_m
    return DistanceField(sample_distance(x0, y0, cell_m, *size, *walls), (x0, y0), cell_m, *walls)


def in_cells_of(floor: Floor, cell_m: float) -> Floor:
    """The floor in cells of another side, each reachable where its middle lies in such a one."""
    (rows, columns), (x0, y0) = floor.reachable.shape, floor.origin_xy_m
    middles = [
        (np.arange(math.ceil(size * floor.cell_m / cell_m - 1e-9)) + 0.5) * cell_m for size in (rows, columns)
    ]
    row, column = (
        np.minimum((at / floor.cell_m).astype(np.int64), size - 1)
        for at, size in zip(middles, (rows, columns), strict=True)
    )
    at = np.ix_(row, column)
    return Floor((x0, y0), cell_m, floor.radius_m, floor.clearance_m[at], floor.reachable[at])


def covered(floor: Floor, path: FloatArray, width_m: float) -> BoolArray:
    """(rows, columns) cells whose middles a pass along a path sweeps."""
    found = np.zeros_like(floor.reachable)
    mark_swept(np.ascontiguousarray(path), 0.5 * width_m, *floor.origin_xy_m, floor.cell_m, found)
    return found


def surely_covered(floor: Floor, trail: FloatArray, width_m: float) -> BoolArray:
    """(rows, columns) cells whose middles a pass along a trail swept, as far as the robot knows.

    Where it was more than twice as unsure of its place as it mostly was, as when it had just begun, the pass
    counts as narrower: by two standard deviations to either side beyond that. To ask for more of all of a
    sweep would be to ask for it again; passes overlap by what a robot mostly is beside where it believes.

    Parameters
    ----------
    trail
        (N, 3) x, y and their standard deviation [m].
    """
    found = np.zeros_like(floor.reachable)
    unsure_m = np.maximum(trail[:-1, 2], trail[1:, 2])
    usual_m = float(np.median(trail[:, 2]))
    radius_m = 0.5 * width_m - 2.0 * np.maximum(0.0, unsure_m - 2.0 * usual_m)
    steps = np.ceil(radius_m / STEP_M)
    for first, last in itertools.pairwise([0, *(np.flatnonzero(np.diff(steps)) + 1).tolist(), len(steps)]):
        if last > first and (radius := float(radius_m[first:last].min())) > 0.0:
            line = np.ascontiguousarray(trail[first : last + 1, :2])
            mark_swept(line, radius, *floor.origin_xy_m, floor.cell_m, found)
    return found


def _but_the_least(cells: BoolArray, most: float) -> BoolArray:
    """Cells without the smallest pieces of them, of so many cells together at most."""
    pieces, _ = scipy.ndimage.label(cells, structure=np.ones((3, 3)))
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    smallest = np.argsort(sizes, kind="stable")
    dropped = smallest[np.cumsum(sizes[smallest]) <= most]
    return np.asarray(cells & ~np.isin(pieces, dropped))
