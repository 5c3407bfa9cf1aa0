"""A recording as rows to fit: windows of commanded and true motion, and readings over true ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.mrclam import MrclamLog

WINDOW_S = 2.0
SHORT_WINDOW_S = 0.5
"""Short enough for a delay of 0.05 s to be seen."""
LOSS_UP_TO_RAD_S = 0.45
CLUSTER_S = 60.0


@dataclass(frozen=True, slots=True)
class DriveRows:
    """The rows of the regressions, of one recording.

    Attributes
    ----------
    windows
        (N, 5) mean commanded speed and turn rate, speed times bounded turn rate, true speed, true turn rate.
    window_t_s
        (N,) begins of the windows.
    minutes, reading_minutes
        (N,) and (M,) which minute of which recording a row is of: recording times ``MINUTES`` plus minute.
    log_ratio, log_cosine
        (M,) logarithms of reading over true range and of the bearing's cosine, where truth is known.
    """

    MINUTES: ClassVar[int] = 1_000_000

    windows: FloatArray
    window_t_s: FloatArray
    minutes: IntArray
    log_ratio: FloatArray
    log_cosine: FloatArray
    reading_minutes: IntArray


def drive_rows(log: MrclamLog, delay_s: float, number: int) -> DriveRows:
    """Rows of a recording whose commands act ``delay_s`` late; ``number`` tells recordings apart."""
    begin, table = _windows(log, delay_s, WINDOW_S)
    t, ratio, cosine = _ratios(log)
    first = float(log.odometry_t_s[0])
    return DriveRows(
        table,
        begin,
        number * DriveRows.MINUTES + _minutes(begin, first),
        ratio,
        cosine,
        number * DriveRows.MINUTES + _minutes(t, first),
    )


def residual_turns(log: MrclamLog, delays_s: FloatArray) -> FloatArray:
    """(G, D + 1) by minute: sums of the squared turn rate that each delay leaves, and how many windows."""
    columns, minutes = [], np.zeros(0, dtype=np.int64)
    for delay_s in delays_s:
        begin, table = _windows(log, float(delay_s), SHORT_WINDOW_S)
        minutes = _minutes(begin, float(log.odometry_t_s[0]))
        claimed, w = table[:, 1], table[:, 4]
        gain = float(claimed @ w) / max(float(claimed @ claimed), 1e-12)
        columns.append((w - gain * claimed) ** 2)
    rows = np.column_stack([*columns, np.ones(minutes.shape[0])])
    _, member = np.unique(minutes, return_inverse=True)
    sums = np.zeros((int(member.max(initial=-1)) + 1, rows.shape[1]))
    np.add.at(sums, member, rows)
    return sums


def _minutes(t_s: FloatArray, first_s: float) -> IntArray:
    return np.asarray(np.maximum((t_s - first_s) // CLUSTER_S, 0.0), dtype=np.int64)


def _windows(log: MrclamLog, delay_s: float, window_s: float) -> tuple[FloatArray, FloatArray]:
    """Begins (N,) of windows apart from the truth's gaps, and the table (N, 5) of ``DriveRows``."""
    t, truth_t = log.odometry_t_s, log.truth_t_s
    first_s, last_s = max(t[0], truth_t[0]) + 1.0, min(t[-1], truth_t[-1]) - window_s
    begin = _beside_gaps(first_s, last_s, window_s, log.truth_gaps_s)
    end = begin + window_s
    for left, right in log.truth_gaps_s:
        apart = (end < left) | (begin > right)
        begin, end = begin[apart], end[apart]
    v, w = log.speed_m_s[:-1], log.turn_rate_rad_s[:-1]
    rates = (v, w, v * np.minimum(np.abs(w), LOSS_UP_TO_RAD_S))
    step = np.diff(t)
    sums = [np.concatenate([[0.0], np.cumsum(step * rate)]) for rate in rates]
    claimed = [(np.interp(end - delay_s, t, s) - np.interp(begin - delay_s, t, s)) / window_s for s in sums]
    # The true distance along the path, so that arcs count in full; 0.1 s steps keep the tracker's jitter out.
    clock = _beside_gaps(truth_t[0], truth_t[-1], 0.1, log.truth_gaps_s)
    x, y = (np.interp(clock, truth_t, log.truth[:, i]) for i in (0, 1))
    unwrapped = np.unwrap(log.truth[:, 2])
    middle = np.interp(clock[:-1] + 0.05, truth_t, unwrapped)
    gone = np.concatenate([[0.0], np.cumsum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))])
    moved = (np.interp(end, clock, gone) - np.interp(begin, clock, gone)) / window_s
    turned = (np.interp(end, truth_t, unwrapped) - np.interp(begin, truth_t, unwrapped)) / window_s
    return begin, np.column_stack([*claimed, moved, turned])


def _beside_gaps(first_s: float, last_s: float, step_s: float, gaps_s: FloatArray) -> FloatArray:
    """(N,) the times of ``np.arange`` but those far inside a gap (K, 2), which may be years long."""
    edges = [first_s, *gaps_s.ravel().tolist(), last_s]
    pieces = [
        np.arange(max((left - first_s) // step_s - 1.0, 0.0), (right - first_s) // step_s + 2.0)
        for left, right in zip(edges[::2], edges[1::2], strict=True)
    ]
    steps = np.unique(np.concatenate(pieces))
    steps = steps[steps < math.ceil((last_s - first_s) / step_s)]
    return np.asarray(first_s + steps * ((first_s + step_s) - first_s))


def _ratios(log: MrclamLog) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, logarithms of reading over true range and of the bearing's cosine, where truth is known."""
    rows = log.of_landmarks
    t = log.measurement_t_s[rows]
    inside = (t >= log.truth_t_s[0]) & (t <= log.truth_t_s[-1])
    for left, right in log.truth_gaps_s:
        inside &= (t < left) | (t > right)
    inside &= (log.ranges_m[rows] > 0.1) & (np.cos(log.bearings_rad[rows]) > 0.2)
    rows, t = rows[inside], t[inside]
    known = log.landmarks.by_id()
    places = known.points[np.searchsorted(known.ids, log.subjects[rows])]
    x, y = (np.interp(t, log.truth_t_s, log.truth[:, i]) for i in (0, 1))
    true = np.hypot(places[:, 0] - x, places[:, 1] - y)
    return t, np.log(log.ranges_m[rows] / true), np.log(np.cos(log.bearings_rad[rows]))
