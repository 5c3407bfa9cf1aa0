"""Which cells of the floor a scanner has in view."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

SECTORS = 192
"""What a beam's whole neighbourhood shows, or does not, needs no angle."""
MOST_BEAMS = 64
"""In a sector; finer fans are looked at cell by cell."""
LEAST = 1e-300
"""In place of a distance of 0, which has no direction."""
SLACK = 1e-9
"""Of ranges, so that rounding never decides."""


def _ends_rad() -> FloatArray:
    """(SECTORS,) the direction at which each sector ends: 1 - |turned - 2| is its x, and the rest its y."""
    turned = 4.0 * np.arange(1, SECTORS + 1) / SECTORS
    x = np.where(turned <= 2.0, 1.0 - turned, turned - 3.0)
    return np.arctan2(np.where(turned <= 2.0, 1.0 - np.abs(x), np.abs(x) - 1.0), x)


ENDS_RAD = _ends_rad()


@kernel
def mark_seen(
    seen_s: FloatArray,
    cells_xy: FloatArray,
    x: float,
    y: float,
    first: float,
    step: float,
    ranges: FloatArray,
    reach: float,
    half_m: float,
    t: float,
) -> None:
    """Set ``seen_s`` (K,) to ``t`` in place for the cells (K, 2) that a fan of beams from (x, y) passes.

    Parameters
    ----------
    first, step, ranges
        Direction of beam 0 in the map frame, angle between beams, (B,) lengths.
    reach
        The scanner's largest range.
    half_m
        Half a cell's diagonal: a beam that ends so near before a cell's middle has it still in view.
    """
    beams, count = ranges.shape[0], cells_xy.shape[0]
    full = 2.0 * math.pi
    least, most = np.empty(SECTORS), np.empty(SECTORS)
    sector_ranges(first, step, ranges, half_m, least, most)
    squared, sectors = np.empty(count), np.empty(count, np.uint64)
    for k in range(count):  # without a branch: the processor takes several cells at once
        dx, dy = cells_xy[k, 0] - x, cells_xy[k, 1] - y
        squared[k] = dx * dx + dy * dy
        sectors[k] = sector_of(dx, dy)
    for k in range(count):
        sector = sectors[k]
        if squared[k] > most[sector] or squared[k] > reach * reach:
            continue
        if squared[k] > least[sector]:
            away = math.sqrt(squared[k])
            if away > half_m:
                turn = (math.atan2(cells_xy[k, 1] - y, cells_xy[k, 0] - x) - first) % full
                beam = round(turn / step)
                if beam >= beams:
                    # The fan does not close, or the last beam is the first one's neighbour.
                    beam = 0 if (full - turn) < 0.5 * step else -1
                if beam < 0 or ranges[beam] + half_m < away:
                    continue
        seen_s[k] = t


@kernel
def sector_of(dx: float, dy: float) -> int:
    """One of ``SECTORS`` around the origin, by a measure that grows with the angle and needs none."""
    share = dx / max(abs(dx) + abs(dy), LEAST)
    turned = 1.0 - share if dy >= 0.0 else 3.0 + share
    return min(int(turned * (0.25 * SECTORS)), SECTORS - 1)


@kernel
def sector_ranges(
    first: float, step: float, ranges: FloatArray, half_m: float, least: FloatArray, most: FloatArray
) -> None:
    """Fill in, squared, up to where all of a sector is in view, and from where on nothing of it.

    By the beams of the sector and one more to each side; ``least`` is below 0 where a part of it has no beam.
    """
    beams = ranges.shape[0]
    full = 2.0 * math.pi
    if full > step * (SECTORS * MOST_BEAMS):
        least[:], most[:] = -1.0, np.inf
        return
    around = max(1, math.floor(full / step + 0.5))
    begin = 0.0
    for s in range(SECTORS):
        end = ENDS_RAD[s]
        if end <= begin:
            end += full
        low, high = math.floor((begin - first) / step) - 1, math.ceil((end - first) / step) + 1
        begin = end if s + 1 < SECTORS else 0.0
        nearest, farthest = np.inf, 0.0
        beam = low % around
        for _ in range(high - low + 1):
            seen = ranges[beam] if beam < beams else -np.inf
            nearest, farthest = min(nearest, seen), max(farthest, seen)
            beam = beam + 1 if beam + 1 < around else 0
        near_m, far_m = (nearest + half_m) * (1.0 - SLACK), (farthest + half_m) * (1.0 + SLACK)
        least[s] = near_m * near_m if near_m > 0.0 else -1.0
        most[s] = far_m * far_m
