"""From recordings with truth: what commanded velocities do, and what a camera's range readings are.

Least squares over windows of a recording:

    v = g0 v_c - g1 v_c min(|w_c|, 0.45 rad/s),   w = g2 w_c + bend v,   commands ``delay`` late
    log(reading / range) = log(scale) + power log cos(bearing)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.mrclam import MrclamLog

WINDOW_S = 2.0
LOSS_UP_TO_RAD_S = 0.45
DELAYS_S = np.arange(0.0, 0.55, 0.05)
MIN_WINDOWS = 50
MIN_READINGS = 100
MISREAD = 0.15
"""A reading whose log ratio lies farther than this from the median is of another landmark."""


@dataclass(frozen=True, slots=True)
class DriveCommands:
    """What was found; named as in the module's equations."""

    delay_s: float
    speed_gain: float
    speed_loss_per_rad_s: float
    turn_gain: float
    bend_rad_per_m: float
    range_scale: float
    depth_power: float
    windows: int
    readings: int

    def parameters(self) -> dict[str, object]:
        """As parameters of the localizer ``ekf-slow-errors``."""
        return {
            "commands": {
                "delay_s": round(self.delay_s, 3),
                "speed_gain": round(self.speed_gain, 4),
                "speed_loss_per_rad_s": round(max(self.speed_loss_per_rad_s, 0.0), 4),
                "loss_up_to_rad_s": LOSS_UP_TO_RAD_S,
                "turn_gain": round(self.turn_gain, 4),
                "bend_rad_per_m": round(self.bend_rad_per_m, 4),
            },
            "range_scale": round(self.range_scale, 4),
            "depth_power": round(min(max(self.depth_power, 0.0), 2.0), 3),
        }


def calibrate_commands(logs: Sequence[MrclamLog]) -> DriveCommands:
    """Fit the map from commands to motion, and the range readings, over several recordings at once.

    Raises
    ------
    InputError
        Where the recordings hold too little to learn from.
    """
    delay = min(DELAYS_S, key=lambda d: sum(_delay_residual(log, float(d)) for log in logs))
    table = np.concatenate([_windows(log, float(delay), WINDOW_S) for log in logs])
    ratio, cosine = (np.concatenate(x) for x in zip(*(_ratios(log) for log in logs), strict=True))
    if table.shape[0] < MIN_WINDOWS or ratio.shape[0] < MIN_READINGS:
        raise InputError(
            f"calibrate commands: expected {MIN_WINDOWS} windows of {WINDOW_S:g} s with truth and "
            f"{MIN_READINGS} readings, found {table.shape[0]} and {ratio.shape[0]}"
        )
    claimed_v, claimed_w, lost, v, w = table.T
    (gain, loss), *_ = np.linalg.lstsq(np.column_stack([claimed_v, -lost]), v, rcond=None)
    (turn, bend), *_ = np.linalg.lstsq(np.column_stack([claimed_w, v]), w, rcond=None)
    near = np.abs(ratio - np.median(ratio)) < MISREAD
    design = np.column_stack([np.ones(near.sum()), cosine[near]])
    (scale, power), *_ = np.linalg.lstsq(design, ratio[near], rcond=None)
    return DriveCommands(
        delay_s=float(delay),
        speed_gain=float(gain),
        speed_loss_per_rad_s=float(loss),
        turn_gain=float(turn),
        bend_rad_per_m=float(bend),
        range_scale=float(np.exp(scale)),
        depth_power=float(power),
        windows=table.shape[0],
        readings=int(near.sum()),
    )


def _delay_residual(log: MrclamLog, delay_s: float) -> float:
    """Mean squared turn that short windows leave unexplained."""
    _, claimed, _, _, w = _windows(log, delay_s, 0.5).T
    if w.shape[0] == 0:
        return 0.0
    gain = float(claimed @ w) / max(float(claimed @ claimed), 1e-12)
    return float(np.mean((w - gain * claimed) ** 2))


def _windows(log: MrclamLog, delay_s: float, window_s: float) -> FloatArray:
    """(N, 5) mean commanded speed and turn rate, speed times bounded turn rate, true speed, turn rate."""
    t, truth_t = log.odometry_t_s, log.truth_t_s
    begin = np.arange(max(t[0], truth_t[0]) + 1.0, min(t[-1], truth_t[-1]) - window_s, window_s)
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
    clock = np.arange(truth_t[0], truth_t[-1], 0.1)
    x, y = (np.interp(clock, truth_t, log.truth[:, i]) for i in (0, 1))
    unwrapped = np.unwrap(log.truth[:, 2])
    middle = np.interp(clock[:-1] + 0.05, truth_t, unwrapped)
    gone = np.concatenate([[0.0], np.cumsum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))])
    moved = (np.interp(end, clock, gone) - np.interp(begin, clock, gone)) / window_s
    turned = (np.interp(end, truth_t, unwrapped) - np.interp(begin, truth_t, unwrapped)) / window_s
    return np.column_stack([*claimed, moved, turned])


def _ratios(log: MrclamLog) -> tuple[FloatArray, FloatArray]:
    """Logarithms of reading over true range and of the bearing's cosine, where truth is known."""
    rows = log.of_landmarks
    t = log.measurement_t_s[rows]
    inside = (t >= log.truth_t_s[0]) & (t <= log.truth_t_s[-1])
    for left, right in log.truth_gaps_s:
        inside &= (t < left) | (t > right)
    inside &= (log.ranges_m[rows] > 0.1) & (np.cos(log.bearings_rad[rows]) > 0.2)
    rows, t = rows[inside], t[inside]
    order = np.argsort(log.landmarks.ids)
    places = log.landmarks.points_xy_m[order][np.searchsorted(log.landmarks.ids[order], log.subjects[rows])]
    x, y = (np.interp(t, log.truth_t_s, log.truth[:, i]) for i in (0, 1))
    true = np.hypot(places[:, 0] - x, places[:, 1] - y)
    return np.log(log.ranges_m[rows] / true), np.log(np.cos(log.bearings_rad[rows]))
