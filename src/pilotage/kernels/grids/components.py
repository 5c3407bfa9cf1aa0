"""Connected components of a grid's free cells, by runs: what can be reached from where, at a glance.

A row's free cells form runs; runs of neighbouring rows that touch are united (union-find with path
halving, the smaller index the root). Runs take far less room than a label for every cell, and one pass
over the bytes makes them. Without cutting corners a diagonal step implies two straight ones, so that the
components are those of four neighbours; with it, of eight.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import ByteArray, IntArray, UintArray
from pilotage.kernels.grids.moves import doubled, is_blocked, signed
from pilotage.kernels.jit import kernel


class Runs(NamedTuple):
    """Runs of free cells: flat index of first cell and of the one after the last, component of each.

    ``row_start`` (rows + 1,) is the first run of every row of the padded grid; a component is named by its
    first run.
    """

    row_start: IntArray
    begin: UintArray
    end: UintArray
    component: UintArray


@kernel
def label_runs(states: ByteArray, stride: int, cut_corners: bool) -> Runs:
    """Find the runs of a padded grid and unite those that touch."""
    rows = states.shape[0] // stride
    begin, end = _find_runs(states)
    count = begin.shape[0]
    row_start = np.zeros(rows + 1, np.int64)
    run = 0
    for row in range(rows):
        row_start[row] = run
        while run < count and signed(begin[run]) < (row + 1) * stride:
            run += 1
    row_start[rows] = count
    parent = np.arange(count).astype(np.uint32)
    reach = 1 if cut_corners else 0
    for row in range(1, rows):
        above, last_above = row_start[row - 1], row_start[row]
        here, last_here = row_start[row], row_start[row + 1]
        while above < last_above and here < last_here:
            above_end, here_end = signed(end[above]) + stride, signed(end[here])
            above_begin, here_begin = signed(begin[above]) + stride, signed(begin[here])
            if above_begin < here_end + reach and here_begin < above_end + reach:
                _unite(parent, above, here)
            if above_end < here_end:
                above += 1
            else:
                here += 1
    for run in range(count):
        parent[run] = parent[parent[run]]
    return Runs(row_start, begin, end, parent)


@kernel
def _find_runs(states: ByteArray) -> tuple[UintArray, UintArray]:
    """First and one-after-last cell of every run of free cells; the frame keeps rows apart.

    Eight cells are looked at as one word, and only words in which something changes cell by cell.
    """
    n_words = states.shape[0] // 8
    words = states[: 8 * n_words].view(np.uint64)
    blocked_bits = np.uint64(0x8080808080808080)
    begin = np.empty(1 << 12, np.uint32)
    end = np.empty(1 << 12, np.uint32)
    count = 0
    inside = False
    for word in range(n_words + 1):
        unchanged = np.uint64(0) if inside else blocked_bits
        if word < n_words and words[word] & blocked_bits == unchanged:
            continue
        if count + 8 > begin.shape[0]:
            begin, end = doubled(begin), doubled(end)
        for cell in range(8 * word, min(8 * word + 8, states.shape[0])):
            free = not is_blocked(states, cell)
            if free == inside:
                continue
            if free:
                begin[count] = cell
            else:
                end[count] = cell
                count += 1
            inside = free
    return begin[:count].copy(), end[:count].copy()


@kernel
def component_of(runs: Runs, stride: int, cell: int) -> int:
    """Component of a cell of the padded grid; -1 where it is blocked."""
    row = cell // stride
    low, high = runs.row_start[row], runs.row_start[row + 1]
    while low < high:
        middle = (low + high) // 2
        if signed(runs.end[middle]) <= cell:
            low = middle + 1
        else:
            high = middle
    if low == runs.row_start[row + 1] or signed(runs.begin[low]) > cell:
        return -1
    return int(runs.component[low])


@kernel
def _unite(parent: UintArray, a: int, b: int) -> None:
    root_a, root_b = _root(parent, a), _root(parent, b)
    if root_a < root_b:
        parent[root_b] = root_a
    else:
        parent[root_a] = root_b


@kernel
def _root(parent: UintArray, run: int) -> int:
    while signed(parent[run]) != run:
        parent[run] = parent[parent[run]]
        run = signed(parent[run])
    return run
