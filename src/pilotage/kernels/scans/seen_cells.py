"""Which cells of the floor a scanner has in view."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel


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
    beams = ranges.shape[0]
    full = 2.0 * math.pi
    for k in range(cells_xy.shape[0]):
        dx, dy = cells_xy[k, 0] - x, cells_xy[k, 1] - y
        squared = dx * dx + dy * dy
        if squared > reach * reach:
            continue
        away = math.sqrt(squared)
        if away > half_m:
            turn = (math.atan2(dy, dx) - first) % full
            beam = round(turn / step)
            if beam >= beams:
                # The fan does not close, or the last beam is the first one's neighbour.
                beam = 0 if (full - turn) < 0.5 * step else -1
            if beam < 0 or ranges[beam] + half_m < away:
                continue
        seen_s[k] = t
