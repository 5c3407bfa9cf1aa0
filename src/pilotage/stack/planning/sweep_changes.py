"""A sweep changed at random, as a whole, until it is short for what it sweeps."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.patrol.passes import Ground, count_along, left_in_blocks
from pilotage.kernels.patrol.reshape import reshape, straightened
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.floor import Floor
from pilotage.stack.planning.sweep_floor import Sought

TRIES_A_WIDTH, MOST_TRIES, BATCH, BATCHES = 700, 6_000_000, 20_000, 20
"""Changes that are tried to the path, for each width of its length, and at most; so many draws at once at
most, and batches at least: prices rise from one to the next."""
CHANGE_CELLS, MARGIN, MOST_CHANGE_CELLS = 20, 0.25, 12_000_000
"""Cells a width that these changes are judged by, for they would find slivers between the middles of coarser
ones (36 took twice the time for a millionth less left); a pass is taken to be narrower by so much of a cell
to either side."""
WARM, COLD = 0.15, 0.001
"""Temperature of these changes at first and in the end, in widths."""
TURN = 0.15
"""What a radian of turning costs, in widths: a robot that stops for every bend takes longer for them than for
the way. Changes that turn less are shorter in the end as well; from 0.25 on they are not everywhere."""
STRAIGHT = 0.01
"""Of the width may a line pass beside the vertices that it takes the place of."""
FLOOR_WORTH, FLOOR_WORTH_END, RIM_WORTH = 3.0, 60.0, 3.0
"""A cell that is left costs so many times what it takes a pass to sweep it: of the floor where the robot's
centre can be, which has to be swept all in the end, and of the rim that only its body reaches, where corners
may be left that would take more."""


def reshaped(field: DistanceField, sought: Sought, path: FloatArray) -> FloatArray:
    """(N, 2) the path changed at random until it is short for what it sweeps, through the inner floor."""
    floor, width_m = sought.floor, sought.width_m
    line = subdivided(path, width_m)
    size = len(line)
    # Vertices are put in and left out: room for three times as many.
    path = np.zeros((3 * size + 100, 2))
    path[:size] = line
    x0, y0 = (float(at) for at in floor.origin_xy_m)
    parts, paths = _parts(floor, width_m), (x0, y0, sought.inner.cell_m)
    fine = x0, y0, floor.cell_m / parts
    kinds = _parted(sought.may, parts).astype(np.uint8)
    kinds[_parted_floor(field, floor, parts) & ~_parted(floor.reachable & ~sought.must, parts)] = 2
    counts, free = np.zeros(kinds.shape, np.int16), np.ascontiguousarray(sought.inner.reachable)
    left = left_in_blocks(kinds, counts)
    cell_price = fine[2] ** 2 / width_m

    def ground(worth: float) -> Ground:
        prices = 0.0, RIM_WORTH * cell_price, worth * cell_price
        return width_m - 2.0 * MARGIN * fine[2], fine, kinds, prices, counts, paths, free, left

    count_along(line, ground(FLOOR_WORTH))
    rng = np.random.default_rng(0)  # the same floor, the same path
    tries = min(TRIES_A_WIDTH * size, MOST_TRIES)
    batches = max(BATCHES, math.ceil(tries / BATCH))
    for batch in range(batches):
        done, then = batch / batches, (batch + 1) / batches
        worth = FLOOR_WORTH * (FLOOR_WORTH_END / FLOOR_WORTH) ** done
        heats = WARM * width_m * (COLD / WARM) ** done, WARM * width_m * (COLD / WARM) ** then
        draws = rng.random((math.ceil(tries / batches), 6))
        size = reshape(path, size, draws, heats, TURN * width_m, ground(worth))
    # Legs of a width are for changing them; every bend that is left is a stop and a turn.
    return straightened(path[:size].copy(), STRAIGHT * width_m, ground(FLOOR_WORTH_END))


def _parts(floor: Floor, width_m: float) -> int:
    """Of a cell's side, odd, so that a cell's middle is that of a part."""
    wanted = CHANGE_CELLS * floor.cell_m / width_m
    most = math.sqrt(MOST_CHANGE_CELLS / floor.reachable.size)
    return max(1, 2 * min(math.ceil(0.5 * wanted - 0.6), math.floor(0.5 * most - 0.5)) + 1)


def _parted(cells: BoolArray, parts: int) -> BoolArray:
    """The same in cells of a part of the side."""
    return np.repeat(np.repeat(cells, parts, axis=0), parts, axis=1)


def _parted_floor(field: DistanceField, floor: Floor, parts: int) -> BoolArray:
    """The floor in cells of a part of the side, with its edge where distances to walls say."""
    near = scipy.ndimage.binary_dilation(floor.reachable, np.ones((3, 3), np.bool_))
    out = _parted(near, parts)
    cell_m, (x0, y0) = floor.cell_m / parts, floor.origin_xy_m
    x = x0 + (np.arange(out.shape[1]) + 0.5) * cell_m
    for row, cells in enumerate(out):
        at = np.column_stack([x[cells], np.full(np.count_nonzero(cells), y0 + (row + 0.5) * cell_m)])
        cells[cells] = field.at(at) >= floor.radius_m
    return out


def subdivided(path: FloatArray, longest_m: float) -> FloatArray:
    """(N, 2) the same path, in legs no longer than so."""
    length_m = np.hypot(*np.diff(path, axis=0).T)
    parts = np.maximum(1, np.ceil(length_m / longest_m - 1e-9)).astype(int)
    at = np.concatenate([k + np.arange(number) / number for k, number in enumerate(parts)])
    at = np.append(at, len(path) - 1)
    return np.column_stack([np.interp(at, np.arange(len(path)), path[:, k]) for k in (0, 1)])
