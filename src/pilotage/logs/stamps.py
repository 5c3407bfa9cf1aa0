"""Times that go back: the order of the file where what was measured speaks for it, and times in it."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray

STEP_S = 1e-6
"""Between two times that were told the wrong way round."""
CLEARLY = 0.98
"""Share of the change along the order of the stamps that the file's order has to stay below."""
MOST_CHANGE_M = 1.0


def keeps_order(values: FloatArray, by_time: IntArray) -> bool:
    """Whether what was measured changes less along the order of the file than along that of the stamps.

    A clock that jitters by more than lies between two scans tells them in a wrong order, of which the robot
    would have to move to and fro.

    Parameters
    ----------
    values
        (N, B) in the order of the file: ranges, or x and y; not finite where nothing was measured.
    by_time
        (N,) the order of the stamps.
    """
    off = np.flatnonzero(by_time != np.arange(by_time.size))
    if off.size == 0:
        return True
    around = np.unique(np.clip(np.concatenate([off - 1, off]), 0, by_time.size - 2))

    def change(order: IntArray) -> float:
        total = 0.0
        for part in np.array_split(around, max(1, around.size // 512)):
            with np.errstate(invalid="ignore"):  # nothing hit twice is no change, and no number
                step = np.abs(values[order[part + 1]] - values[order[part]])
            known = np.isfinite(step)
            each = np.where(known, np.minimum(step, MOST_CHANGE_M), 0.0).sum(axis=1)
            total += float((each / np.maximum(1, known.sum(axis=1))).sum())
        return total

    return change(np.arange(by_time.size)) < CLEARLY * change(by_time)


def increasing(t_s: FloatArray) -> FloatArray:
    """Return the increasing times (N,) nearest to given ones (least squares: pools of adjacent violators)."""
    means: list[float] = []
    counts: list[int] = []
    for t in t_s.tolist():
        means.append(t)
        counts.append(1)
        while len(means) > 1 and means[-2] > means[-1]:
            last, count = means.pop(), counts.pop()
            means[-1] = (means[-1] * counts[-1] + last * count) / (counts[-1] + count)
            counts[-1] += count
    pooled = np.repeat(means, counts)
    # Those of one pool stay apart, so that an order remains in the times.
    within = np.arange(t_s.size) - np.repeat(np.cumsum([0, *counts[:-1]]), counts)
    spread = STEP_S * (within - 0.5 * (np.repeat(counts, counts) - 1))
    return np.maximum.accumulate(np.asarray(pooled + spread))


def apart(t_s: FloatArray) -> FloatArray:
    """Return times (N,) of which no two neighbours are the same: those that are go up in steps of STEP_S."""
    same = np.concatenate([[False], np.diff(t_s) == 0.0])
    k = np.arange(t_s.size)
    first = np.maximum.accumulate(np.where(same, 0, k))
    return np.asarray(t_s + STEP_S * (k - first))


def between_readings(told_s: FloatArray, before: IntArray, readings_s: FloatArray) -> FloatArray:
    """Put times (N,) of scans between those of the odometry's readings they were recorded between.

    Parameters
    ----------
    before
        (N,) how many readings were recorded before each scan; -1: unknown, the time stays.
    readings_s
        (M,) times of the readings in the order of the file, not decreasing.
    """
    if readings_s.size == 0:
        return told_s
    low = np.where(before > 0, readings_s[np.clip(before - 1, 0, readings_s.size - 1)], -np.inf)
    high = np.where(before < readings_s.size, readings_s[np.clip(before, 0, readings_s.size - 1)], np.inf)
    off = told_s - np.clip(told_s, low, high)
    # A scanner may tell when a sweep began, or a driver be late: what all scans have is no jitter.
    usual = float(np.median(off[before >= 0])) if (before >= 0).any() else 0.0
    return np.where(before < 0, told_s, np.clip(told_s, low + usual, high + usual))
