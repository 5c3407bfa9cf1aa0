"""Few places that together see everything: set cover by the greedy rule (Chvatal 1979)."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray, WordArray
from pilotage.kernels.jit import kernel


@kernel
def greedy_cover(sees: BoolArray, preference: FloatArray, covered: BoolArray) -> IntArray:
    """Places (K,) in the order of their choice; each sees most of what none before it sees.

    Parameters
    ----------
    sees
        (P, M) which points are in view from which places.
    preference
        (P,) decides between places that see equally many.
    covered
        (M,) points that need no place; filled with what is seen in the end.

    Notes
    -----
    At most ln M + 1 times as many as the fewest. Points that no place sees are left over.
    """
    count = sees.shape[0]
    gain = np.zeros(count, np.int64)
    for p in range(count):
        for m in range(sees.shape[1]):
            if sees[p, m] and not covered[m]:
                gain[p] += 1
    chosen = np.empty(count, np.int64)
    number = 0
    for _ in range(count):
        best = -1
        for p in range(count):
            if gain[p] == 0:
                continue
            tied = best >= 0 and gain[p] == gain[best]
            if best < 0 or gain[p] > gain[best] or (tied and preference[p] > preference[best]):
                best = p
        if best < 0:
            break
        chosen[number] = best
        number += 1
        for m in range(sees.shape[1]):
            if sees[best, m] and not covered[m]:
                covered[m] = True
                for p in range(count):
                    if sees[p, m]:
                        gain[p] -= 1
    return chosen[:number].copy()


@kernel
def holding_no_other(words: WordArray, sizes: IntArray) -> BoolArray:
    """(K,) which of the sets, rows of bits (K, W), hold no other one; of equal ones the first does not.

    ``sizes`` (K,) is how many each holds. Nearly all pairs differ in the first word of the smaller one that
    is not empty.
    """
    count, width = words.shape
    first, out = np.zeros(count, np.int64), np.ones(count, np.bool_)
    for i in range(count):
        while first[i] < width and words[i, first[i]] == 0:
            first[i] += 1
    for i in range(count):
        for j in range(count):
            if sizes[j] > sizes[i] or (sizes[j] == sizes[i] and j >= i):
                continue
            is_held, k = True, first[j]
            while is_held and k < width:
                is_held = words[j, k] & ~words[i, k] == 0
                k += 1
            if is_held:
                out[i] = False
                break
    return out
