"""Long series made short without losing their peaks, and steps grouped into spans of time."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import BoolArray, FloatArray

BUCKETS = 420
"""Two points in each is about one a screen pixel: more cannot be seen."""


def decimate(t_s: FloatArray, values: FloatArray, buckets: int = BUCKETS) -> tuple[FloatArray, FloatArray]:
    """Thin a series to the least and the greatest value of each bucket of equally many steps.

    Parameters
    ----------
    t_s, values
        (N,); NaN values are gaps.
    buckets
        The result has at most ``2 * buckets`` points.

    Returns
    -------
    (M,) times and values in the order of time. A bucket without any value stays as a gap.
    """
    n = len(values)
    if n <= 2 * buckets:
        return t_s, values
    width = -(-n // buckets)
    padded = np.full(width * (-(-n // width)), np.nan)
    padded[:n] = values
    table = padded.reshape(-1, width)
    gap = np.isnan(table)
    low = np.where(gap, np.inf, table).argmin(axis=1)
    high = np.where(gap, -np.inf, table).argmax(axis=1)
    first = np.arange(len(table)) * width
    picks = np.stack([first + np.minimum(low, high), first + np.maximum(low, high)], axis=1).reshape(-1)
    # The last bucket is padded with NaN and never picks its padding unless all of it is a gap.
    picks = np.minimum(picks, n - 1)
    # The first and the last step are where a reader looks for the start and the end.
    picks = np.unique(np.concatenate([[0], picks, [n - 1]]))
    return t_s[picks], values[picks]


def band(t_s: FloatArray, half_width: FloatArray, buckets: int = BUCKETS) -> tuple[FloatArray, FloatArray]:
    """Thin the half width of a band to its greatest value a bucket: a band may grow, never shrink."""
    n = len(half_width)
    if n <= 2 * buckets:
        return t_s, half_width
    width = -(-n // buckets)
    edges = np.arange(0, n, width)
    peaks = np.maximum.reduceat(np.where(np.isnan(half_width), -np.inf, half_width), edges)
    peaks[np.isneginf(peaks)] = np.nan
    times = t_s[edges]
    return np.append(times, t_s[-1]), np.append(peaks, half_width[-1])


def running_mean(values: FloatArray, window: int) -> FloatArray:
    """Mean over the last ``window`` steps that hold a value; NaN before half a window is filled."""
    finite = np.isfinite(values)
    total = np.concatenate([[0.0], np.cumsum(np.where(finite, values, 0.0))])
    filled = np.concatenate([[0], np.cumsum(finite)])
    last = np.arange(1, len(values) + 1)
    first = np.maximum(last - window, 0)
    members = filled[last] - filled[first]
    enough = (members > 0) & (last >= min(window, len(values)) / 2)
    mean = np.full(len(values), np.nan)
    mean[enough] = (total[last] - total[first])[enough] / members[enough]
    return mean


def spans(t_s: FloatArray, inside: BoolArray) -> FloatArray:
    """Return (k, 2) starts and ends of the stretches of time whose steps are ``inside``.

    A stretch ends where the next step begins, so that a single step is still seen.
    """
    if not bool(inside.any()):
        return np.empty((0, 2))
    edges = np.diff(np.concatenate([[0], inside.astype(np.int8), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    step = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.1
    times = np.append(t_s, t_s[-1] + step)
    return np.stack([times[starts], times[ends]], axis=1)


def merge_spans(stretches: FloatArray, gap_s: float) -> FloatArray:
    """Join stretches that lie closer together than ``gap_s``: a flicker is drawn as one."""
    if len(stretches) < 2:
        return stretches
    apart = stretches[1:, 0] - stretches[:-1, 1] > gap_s
    starts = stretches[np.concatenate([[True], apart]), 0]
    ends = stretches[np.concatenate([apart, [True]]), 1]
    return np.stack([starts, ends], axis=1)
