"""Which marked cell is nearest to each cell, kept while single cells become marked and unmarked.

As ``nearest_marked`` it names the least by squared distance, column and row, in this order. What one cell
changes is found along the rows. Squared distances to two cells differ by a linear function, so that by which
a cell is nearer than all others, the least of such differences, has one hill: in a row at the place where
the columns of the others pass its own, and less and less from row to row once it is below 0.
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import ByteArray, IntArray
from pilotage.kernels.grids.distance import FAR, CellIndex, envelope, nearest_marked
from pilotage.kernels.jit import kernel

MOST_CHANGED = 128
"""Where more cells change than this all is worked out anew, which then costs less."""


@kernel
def keep_nearest(marked: ByteArray, before: ByteArray, rise: CellIndex, nearest: CellIndex) -> None:
    """Bring ``rise`` and ``nearest``, those of ``before``, up to the cells that are ``marked`` now; in place.

    Parameters
    ----------
    marked, before
        (rows, columns) 0 where a cell is not marked; afterwards ``before`` is as ``marked``.
    rise, nearest
        (rows, columns) as ``nearest_marked`` gives them.
    """
    columns = marked.shape[1]
    now, then = marked.reshape(-1), before.reshape(-1)
    changed, count, stay = _changed(now, then)
    if count <= MOST_CHANGED and stay:
        height, site, begins = np.empty((3, columns), np.int64)
        for k in range(count):
            if now[changed[k]] > 0:
                _mark(changed[k] // columns, changed[k] % columns, rise, nearest)
        for k in range(count):
            if now[changed[k]] == 0:
                _unmark(changed[k] // columns, changed[k] % columns, rise, nearest, height, site, begins)
    elif count > 0:
        rise[:], nearest[:] = nearest_marked(marked > 0)
    then[:] = now


@kernel
def _changed(now: ByteArray, then: ByteArray) -> tuple[IntArray, int, bool]:
    """Flat indices of the first cells that differ, how many do, and whether one is marked before and after.

    Most cells are as they were: looked at eight by eight.
    """
    out = np.empty(MOST_CHANGED, np.int64)
    count, stay = 0, False
    whole = now.shape[0] // 8
    words, earlier = now[: 8 * whole].view(np.uint64), then[: 8 * whole].view(np.uint64)
    for word in range(whole + 1):
        if word < whole and words[word] == earlier[word]:
            stay = stay or words[word] != 0
            continue
        for i in range(8 * word, min(8 * word + 8, now.shape[0])):
            stay = stay or (now[i] > 0 and then[i] > 0)
            if (now[i] > 0) != (then[i] > 0):
                if count < MOST_CHANGED:
                    out[count] = i
                count += 1
    return out, count, stay


@kernel
def _mark(row: int, column: int, rise: CellIndex, nearest: CellIndex) -> None:
    """Take a cell that is marked now into both arrays; another one has to be marked already."""
    rows, columns = nearest.shape
    flat = np.int32(row * columns + column)
    for up in (1, -1):
        r, at, wins = row if up == 1 else row - 1, column, True
        while 0 <= r < rows:
            away, old = r - row, int(rise[r, column])
            # Of two as near in a column it is the lower one.
            if not (abs(away) < abs(old) or (away == -old and away > 0)):
                break
            rise[r, column] = away
            if wins:
                at = _passing(nearest, r, column, at)
                x = at - 1
                while x >= 0 and _gain(x, r, row, column, nearest[r, x], columns) > 0:
                    nearest[r, x] = flat
                    x -= 1
                after = at
                while after < columns and _gain(after, r, row, column, nearest[r, after], columns) >= 0:
                    nearest[r, after] = flat
                    after += 1
                wins = after - x > 1 or _may_win(nearest, r, at, row, column)
            r += up


@kernel
def _unmark(
    row: int,
    column: int,
    rise: CellIndex,
    nearest: CellIndex,
    height: IntArray,
    site: IntArray,
    begins: IntArray,
) -> None:
    """Take a cell that is marked no more out of both arrays; another one has to stay marked.

    ``height``, ``site`` and ``begins`` (columns,) are room to work in.
    """
    rows, columns = nearest.shape
    flat = np.int32(row * columns + column)
    low, high = row, row
    while low > 0 and low - 1 - rise[low - 1, column] == row:
        low -= 1
    while high < rows - 1 and high + 1 - rise[high + 1, column] == row:
        high += 1
    below = low - 1 - int(rise[low - 1, column]) if low > 0 else -FAR
    above = high + 1 - int(rise[high + 1, column]) if high < rows - 1 else rows + FAR
    for r in range(low, high + 1):
        down, up = min(r - below, FAR), min(above - r, FAR)
        rise[r, column] = -up if up < down else down
    for up in (1, -1):
        r, at, wins = row if up == 1 else row - 1, column, True
        while wins and low <= r <= high:
            at = _passing(nearest, r, column, at)
            end = at
            while end < columns and nearest[r, end] == flat:
                end += 1
            if end > at:
                # Nobody wins here now whose column is not between those of the winners on either side.
                first = nearest[r, at - 1] % columns if at > 0 else 0
                last = nearest[r, end] % columns if end < columns else columns - 1
                for c in range(first, last + 1):
                    height[c] = np.int64(rise[r, c]) ** 2
                until = end
                for k in range(envelope(height, site, begins, first, last + 1), -1, -1):
                    begin = min(max(begins[k], at), until)
                    nearest[r, begin:until] = (r - rise[r, site[k]]) * columns + site[k]
                    until = begin
            else:
                wins = _may_win(nearest, r, at, row, column)
            r += up


@kernel
def _passing(nearest: CellIndex, r: int, column: int, at: int) -> int:
    """Where in row ``r`` the nearest cells' columns reach ``column``, looked for from ``at`` on."""
    columns = nearest.shape[1]
    while at > 0 and nearest[r, at - 1] % columns >= column:
        at -= 1
    while at < columns and nearest[r, at] % columns < column:
        at += 1
    return at


@kernel
def _gain(x: int, r: int, row: int, column: int, other: int, columns: int) -> int:
    """By how much less the squared distance from (r, x) to (row, column) is than that to another cell."""
    other_row = other // columns
    other_column = other - other_row * columns
    gain: int = (r - other_row) ** 2 + (x - other_column) ** 2 - (r - row) ** 2 - (x - column) ** 2
    return gain


@kernel
def _may_win(nearest: CellIndex, r: int, at: int, row: int, column: int) -> bool:
    """Whether a cell may be as near as any other somewhere in row r between two centres, winning at none.

    Then it may win in a row beyond. The hill's slopes on both sides of ``at``, drawn on, bound its top.
    """
    columns = nearest.shape[1]
    bound = FAR * FAR
    inside = 0 < at < columns
    if at > 0:
        slope = 2 * (column - nearest[r, at - 1] % columns) if inside else 0
        bound = min(bound, _gain(at - 1, r, row, column, nearest[r, at - 1], columns) + slope)
    if at < columns:
        slope = 2 * (nearest[r, at] % columns - column) if inside else 0
        bound = min(bound, _gain(at, r, row, column, nearest[r, at], columns) + slope)
    return bound >= 0
