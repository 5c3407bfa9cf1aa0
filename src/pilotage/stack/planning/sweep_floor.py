"""What of a floor a sweep is for, and where its path may lead."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor, pass_cell_m, sweepable
from pilotage.stack.planning.sweep_room import CELLS, Keeping, path_floor

STEP_M = 0.002
"""Stretches of a trail on which its radius differs by less are taken together, with the least of it."""

FORGIVEN = 4.0
"""So many times as unsure as it mostly is is what a robot may be without its pass counting as narrower."""


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
        (rows, columns) cells of the floor to be swept, where passages lead to them that paths find, and those
        of its rim that may be left.
    width_m
        Of a pass.
    """

    floor: Floor
    inner: Floor
    must: BoolArray
    may: BoolArray
    width_m: float


def whole_floor(field: DistanceField, keeping: Keeping, width_m: float, overlap_m: float) -> Sought:
    """All of the floor, and the rim that only the body reaches; InputError where the body does not fit."""
    radius_m, inside = keeping.radius_m, keeping.start_xy_m
    cell_m = pass_cell_m(width_m, radius_m)
    floor = Floor.of_field(field, field.bounds_m, radius_m, cell_m, inside, exact=True)
    floor = floor.alone(field, cell_m, inside)
    rim = sweepable(floor, width_m) & ~floor.reachable
    laid = []
    for cells in CELLS:
        inner = path_floor(field, keeping, width_m, floor, cells)
        must = floor.reachable & _within_reach(floor, inner, 0.5 * width_m - floor.cell_m)
        laid.append(Sought(floor, inner, must, rim, width_m - overlap_m))
        if not (floor.reachable & ~must).any():
            break
    return max(laid, key=lambda sought: int(np.count_nonzero(sought.must)))


def _within_reach(floor: Floor, inner: Floor, reach_m: float) -> BoolArray:
    """(rows, columns) cells of a floor that are no farther from where its path may lead."""
    away_m = inner.cell_m * scipy.ndimage.distance_transform_edt(~inner.reachable)
    row, column = (
        np.minimum(((np.arange(size) + 0.5) * floor.cell_m / inner.cell_m).astype(np.int64), most - 1)
        for size, most in zip(floor.reachable.shape, away_m.shape, strict=True)
    )
    return np.asarray(away_m[np.ix_(row, column)] <= reach_m)


def rest_of(whole: Sought, trail: FloatArray, width_m: float, enough: float) -> Sought:
    """What a trail left of the floor, but for the least of it, and the rim beside that.

    Parameters
    ----------
    enough
        Share of the floor: the smallest pieces are left for good, down to this.
    """
    floor, swept = whole.floor, surely_covered(whole.floor, trail, width_m, width_m - whole.width_m)
    must = _but_the_least(whole.must & ~swept, (1.0 - enough) * np.count_nonzero(whole.must))
    away_m = floor.cell_m * scipy.ndimage.distance_transform_edt(~must)
    return replace(whole, must=must, may=whole.may & ~swept & (away_m <= 0.5 * width_m))


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


def surely_covered(floor: Floor, trail: FloatArray, width_m: float, overlap_m: float) -> BoolArray:
    """(rows, columns) cells whose middles a pass along a trail swept, as far as the robot knows.

    Where it was more than four times as unsure of its place as it mostly was, as when it had just begun, the
    pass counts as narrower: by two standard deviations to either side beyond that. To ask for more of all of
    a sweep would be to ask for it again; and passes beside one another are mostly off alike, for the same
    walls tell both. Half of what passes overlap is forgiven however sure of the millimetre a robot mostly is.

    Parameters
    ----------
    trail
        (N, 3) x, y and the standard deviation to the side [m].
    """
    found = np.zeros_like(floor.reachable)
    if not len(trail):  # a sweep that ended before its first pass
        return found
    unsure_m = np.maximum(trail[:-1, 2], trail[1:, 2])
    forgiven_m = max(FORGIVEN * float(np.median(trail[:, 2])), 0.5 * overlap_m)
    radius_m = 0.5 * width_m - 2.0 * np.maximum(0.0, unsure_m - forgiven_m)
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
