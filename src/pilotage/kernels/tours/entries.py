"""In which order to visit things that are entered at one place and left at another, with a choice of both.

A generalized path problem: one of several variants of every thing, each with an entry and an exit. Solved by
simulated annealing (Kirkpatrick et al. 1983): no bound is known of how far off it ends.
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel


@kernel
def entries_cost(away: FloatArray, order: IntArray, which: IntArray, variants: int) -> float:
    """From the last but one place of ``away`` by all things in order to the last one."""
    at, total = away.shape[0] - 2, 0.0
    for k in range(order.shape[0]):
        entry = 2 * (variants * order[k] + which[order[k]])
        total += away[at, entry]
        at = entry + 1
    return total + float(away[at, away.shape[0] - 1])


@kernel
def anneal_entries(
    away: FloatArray, things: int, variants: int, draws: FloatArray, warm: float
) -> tuple[IntArray, IntArray]:
    """Order (K,) of the things and the variant (K,) of each by its number.

    Parameters
    ----------
    away
        (2 K variants + 2,) squared: from place to place; entry and exit of each variant of each thing, then
        start and goal.
    draws
        (R, 5) uniform in [0, 1), one row a change that is tried.
    warm
        Temperature to begin with, in units of ``away``; it falls to a thousandth.
    """
    order = np.arange(things)
    which = np.zeros(things, np.int64)
    # Nearest first.
    at = away.shape[0] - 2
    for k in range(things):
        best_j, best_v = k, 0
        for j in range(k, things):
            for v in range(variants):
                entry = 2 * (variants * order[j] + v)
                if away[at, entry] < away[at, 2 * (variants * order[best_j] + best_v)]:
                    best_j, best_v = j, v
        order[k], order[best_j] = order[best_j], order[k]
        which[order[k]] = best_v
        at = 2 * (variants * order[k] + best_v) + 1
    now = entries_cost(away, order, which, variants)
    best, best_order, best_which = now, order.copy(), which.copy()
    trial = order.copy()
    for r in range(draws.shape[0]):
        i, j = int(draws[r, 0] * things), int(draws[r, 1] * things)
        low, high = min(i, j), max(i, j)
        trial[:] = order
        kind = int(draws[r, 2] * 3)
        if kind == 0:  # one elsewhere
            moved = trial[i]
            if i < j:
                trial[i:j] = order[i + 1 : j + 1]
            else:
                trial[j + 1 : i + 1] = order[j:i]
            trial[j] = moved
        elif kind == 1:  # a stretch turned around
            for k in range(low, high + 1):
                trial[k] = order[low + high - k]
        one = trial[j]
        old = which[one]
        which[one] = int(draws[r, 3] * variants)
        new = entries_cost(away, trial, which, variants)
        heat = warm * math.pow(1e-3, r / draws.shape[0])
        if new <= now or draws[r, 4] < math.exp((now - new) / heat):
            order[:] = trial
            now = new
            if now < best:
                best = now
                best_order[:] = order
                best_which[:] = which
        else:
            which[one] = old
    return best_order, best_which
