"""How fast a path can be followed by one that has to be able to stop straight on from everywhere on it."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.field import Field, interpolate_at
from pilotage.kernels.jit import kernel

LOOK_M, TOLERANCE_M = 0.05, 0.02
"""A straight line is looked at so finely; paths between nodes lead a little nearer to walls."""


@kernel
def speed_to_stop(
    way: FloatArray, known: Field, keep_m: float, top: float, braking: float, reaction: float
) -> float:
    """The speed at the begin of a path from which one can slow down to what it may have at each place of it.

    There it may be as fast as it can stop before the wall that is straight on along the path.

    Parameters
    ----------
    way
        (N, 2 or more) places.
    known
        The map's distances.
    keep_m
        What is kept from walls; less where the path leads nearer.
    top, braking, reaction
        Top speed, deceleration, and the time in which it drives on before it brakes.
    """
    known_m, x0, y0, resolution = known
    stop_m = top * reaction + 0.5 * top * top / braking
    best, along_m = top, 0.0
    for k in range(1, way.shape[0]):
        dx, dy = way[k, 0] - way[k - 1, 0], way[k, 1] - way[k - 1, 1]
        length = math.hypot(dx, dy)
        along_m += length
        if length < 1e-6 or 2.0 * braking * along_m > best * best:
            continue
        dx, dy = dx / length, dy / length
        keep = min(keep_m, interpolate_at(way[k, 0], way[k, 1], known_m, x0, y0, resolution)) - TOLERANCE_M
        free_m = 0.0
        while free_m < stop_m:
            x, y = way[k, 0] + (free_m + LOOK_M) * dx, way[k, 1] + (free_m + LOOK_M) * dy
            room = interpolate_at(x, y, known_m, x0, y0, resolution) - keep
            if room < 0.0:
                break
            free_m += max(LOOK_M, room)
        may = math.sqrt(braking * braking * reaction * reaction + 2.0 * braking * free_m) - braking * reaction
        best = min(best, math.sqrt(may * may + 2.0 * braking * along_m))
    return best
