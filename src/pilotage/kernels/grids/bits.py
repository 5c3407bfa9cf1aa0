"""A grid as bits, by rows and by columns, and straight runs over it 64 cells at a time.

A line is a row or a column of the padded grid; bit i of its words is set where cell i - ``LEAD`` is blocked,
and so are all bits before the first and after the last cell.
"""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import ByteArray, WordArray
from pilotage.kernels.grids.moves import signed
from pilotage.kernels.jit import kernel, leading_zeros, trailing_zeros

LEAD = 64
"""Blocked bits before the first of a line, so that a word may begin up to so many bits before it."""


def packed(lines: ByteArray) -> WordArray:
    """Bits of whether cells (L, C) are blocked, (L, words): bit i of a line is cell i - ``LEAD``."""
    n_lines, length = lines.shape
    words = LEAD // 64 + -(-length // 64) + 2
    out = np.full((n_lines, 8 * words), 255, np.uint8)
    bits = np.packbits(lines >> 7, axis=1, bitorder="little")
    if length % 8:
        # Beyond the last cell all is blocked.
        bits[:, -1] |= np.uint8(255 << length % 8 & 255)
    out[:, LEAD // 8 : LEAD // 8 + bits.shape[1]] = bits
    return out.view("<u8").astype(np.uint64, copy=False)


@kernel
def transposed(rows: WordArray, n_columns: int) -> WordArray:
    """The same bits by columns, (``n_columns``, words), block by block of 64 x 64."""
    n_rows = rows.shape[0]
    words = LEAD // 64 + (n_rows + 63) // 64 + 2
    out = np.full((n_columns, words), ~np.uint64(0), np.uint64)
    block = np.empty(64, np.uint64)
    for block_row in range((n_rows + 63) // 64):
        top = 64 * block_row
        for block_column in range((n_columns + 63) // 64):
            for i in range(64):
                inside = top + i < n_rows
                block[i] = rows[top + i, 1 + block_column] if inside else ~np.uint64(0)
            _transpose(block)
            left = 64 * block_column
            for i in range(min(64, n_columns - left)):
                out[left + i, 1 + block_row] = block[i]
    return out


@kernel
def _transpose(block: WordArray) -> None:
    """Transpose 64 x 64 bits in place by swapping ever smaller squares (Warren, Hacker's Delight)."""
    half = 32
    mask = np.uint64(0x00000000FFFFFFFF)
    while half > 0:
        k = 0
        while k < 64:
            swap = ((block[k] >> np.uint64(half)) ^ block[k + half]) & mask
            block[k] ^= swap << np.uint64(half)
            block[k + half] ^= swap
            k = (k + half + 1) & ~half
        half //= 2
        mask ^= mask << np.uint64(half)


@kernel
def word(bits: WordArray, line: int, position: int) -> np.uint64:
    """64 bits of a line from a position on."""
    k, shift = position >> 6, np.uint64(position & 63)
    low = bits[np.uint64(line), np.uint64(k)] >> shift
    return np.uint64(
        low | (bits[np.uint64(line), np.uint64(k + 1)] << np.uint64(1)) << (np.uint64(63) - shift)
    )


@kernel
def is_set(bits: WordArray, line: int, position: int) -> bool:
    """Whether a cell's bit is set."""
    word = bits[np.uint64(line), np.uint64(position >> 6)]
    return bool(word >> np.uint64(position & 63) & np.uint64(1))


@kernel
def run_up(bits: WordArray, line: int, position: int, goal: int, cut_corners: bool) -> int:
    """Cells from a free one up its line to the next jump point or the goal; 0 where an obstacle comes first.

    ``goal`` is its position if it lies on this line, else 0.
    """
    at = position + 1
    while True:
        ahead = word(bits, line, at)
        one, other = word(bits, line - 1, at), word(bits, line + 1, at)
        if cut_corners:
            # Beside the cell blocked, beside the next one free.
            forced = (one & ~word(bits, line - 1, at + 1)) | (other & ~word(bits, line + 1, at + 1))
        else:
            # Beside the cell before blocked, beside the cell free.
            forced = (word(bits, line - 1, at - 1) & ~one) | (word(bits, line + 1, at - 1) & ~other)
        stop = ahead | forced
        if stop != np.uint64(0):
            here = at + trailing_zeros(stop)
            if position < goal <= here:
                return goal - position
            return 0 if is_set(bits, line, here) else here - position
        at += 64


@kernel
def run_down(bits: WordArray, line: int, position: int, goal: int, cut_corners: bool) -> int:
    """As ``run_up``, towards lower positions."""
    at = position - 64
    while True:
        ahead = word(bits, line, at)
        one, other = word(bits, line - 1, at), word(bits, line + 1, at)
        if cut_corners:
            forced = (one & ~word(bits, line - 1, at - 1)) | (other & ~word(bits, line + 1, at - 1))
        else:
            forced = (word(bits, line - 1, at + 1) & ~one) | (word(bits, line + 1, at + 1) & ~other)
        stop = ahead | forced
        if stop != np.uint64(0):
            here = at + 63 - leading_zeros(stop)
            if here <= goal < position:
                return position - goal
            return 0 if is_set(bits, line, here) else position - here
        at -= 64


@kernel
def blocked_around(by_row: WordArray, row: int, position: int) -> int:
    """The eight neighbours as ``grid_moves.blocked_around`` has them."""
    three = np.uint64(7)
    above = signed(word(by_row, row - 1, position - 1) & three)
    here = signed(word(by_row, row, position - 1) & three)
    below = signed(word(by_row, row + 1, position - 1) & three)
    return int(
        here >> 2
        | above >> 2 << 1
        | (above >> 1 & 1) << 2
        | (above & 1) << 3
        | (here & 1) << 4
        | (below & 1) << 5
        | (below >> 1 & 1) << 6
        | below >> 2 << 7
    )
