"""Log-odds of cells from laser scans: hits speak for a wall, beams that pass through against it."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

OddsArray = NDArray[np.int8]
"""Log-odds in whole steps: a byte is enough, and a building has tens of millions of cells."""
OddsGrid: TypeAlias = tuple[OddsArray, float, float, float]
"""Log-odds (rows, columns), row 0 with the least y, x and y of its lower-left corner, and a cell's side."""
HIT_ODDS, MISS_ODDS, MOST_ODDS = 17, 5, 120
"""What a hit adds, what a passing beam takes, and where both end (at most 127); in twentieths."""
WALL_ODDS = HIT_ODDS
"""A beam that nothing came back from says nothing beyond a cell of more than one hit: it was swallowed by
what others saw there (dark paint, glass at a slant), not let through."""


@kernel
def add_scan(
    grid: OddsGrid,
    pose: FloatArray,
    ranges_m: FloatArray,
    first_rad: float,
    step_rad: float,
    farthest_m: float,
) -> None:
    """Add a scan to the log-odds of a grid.

    Parameters
    ----------
    pose
        (3,) of the scanner in the map.
    ranges_m
        (B,) NaN for no measurement; beyond ``farthest_m`` (or infinite) a beam only clears up to there.
    """
    odds, corner_x, corner_y, cell_m = grid
    rows, columns = odds.shape
    ox, oy = (pose[0] - corner_x) / cell_m, (pose[1] - corner_y) / cell_m
    for k in range(ranges_m.shape[0]):
        r = ranges_m[k]
        if not r > 0.0:
            continue
        hit = r <= farthest_m
        reach = (r if hit else farthest_m) / cell_m
        angle = pose[2] + first_rad + step_rad * k
        ux, uy = math.cos(angle), math.sin(angle)
        end_c, end_r = math.floor(ox + ux * reach), math.floor(oy + uy * reach)
        # Walk from cell to cell along the beam (Amanatides and Woo, 1987).
        c, row = math.floor(ox), math.floor(oy)
        sc = 1 if ux > 0.0 else -1
        sr = 1 if uy > 0.0 else -1
        dc = 1.0 / abs(ux) if ux != 0.0 else math.inf
        dr = 1.0 / abs(uy) if uy != 0.0 else math.inf
        tc = ((c + 1 - ox) if ux > 0.0 else (ox - c)) * dc if ux != 0.0 else math.inf
        tr = ((row + 1 - oy) if uy > 0.0 else (oy - row)) * dr if uy != 0.0 else math.inf
        for _ in range(rows + columns):
            if c == end_c and row == end_r:
                break
            if min(tc, tr) > reach:
                break
            if 0 <= row < rows and 0 <= c < columns:
                if not hit and odds[row, c] > WALL_ODDS:
                    break
                odds[row, c] = max(-MOST_ODDS, odds[row, c] - MISS_ODDS)
            if tc < tr:
                tc += dc
                c += sc
            else:
                tr += dr
                row += sr
        if hit and 0 <= end_r < rows and 0 <= end_c < columns:
            odds[end_r, end_c] = min(MOST_ODDS, odds[end_r, end_c] + HIT_ODDS)
