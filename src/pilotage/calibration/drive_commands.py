"""From recordings with truth: what commanded velocities do, and what a camera's range readings are.

Least squares over windows of a recording:

    v = g0 v_c - g1 v_c min(|w_c|, 0.45 rad/s),   w = g2 w_c + bend v,   commands ``delay`` late
    log(reading / range) = log(scale) + power log cos(bearing)

The errors of neighbouring windows and readings hang together (slipping, a landmark that is seen from the
same side), so the intervals take minutes, not rows, as independent; where there are three recordings or
more, whole recordings too, and the wider interval is told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.calibration.clustered import ClusteredFit, clustered_least_squares, jackknife_std
from pilotage.calibration.drive_windows import (
    LOSS_UP_TO_RAD_S,
    DriveRows,
    drive_rows,
    residual_turns,
)
from pilotage.calibration.intervals import Estimate, normal_estimate
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.mrclam import MrclamLog

DELAYS_S = np.arange(0.0, 0.55, 0.05)
MIN_WINDOWS = 50
MIN_READINGS = 100
MIN_RECORDINGS = 3
"""From so many on, differences between recordings count in the intervals."""
MISREAD = 0.15
"""A reading whose log ratio lies farther than this from the median is of another landmark."""


@dataclass(frozen=True, slots=True)
class DriveCommands:
    """What was found; named as in the module's equations.

    Attributes
    ----------
    estimates
        ``delay_s``, ``speed_gain``, ``speed_loss_per_rad_s``, ``turn_gain``, ``bend_rad_per_m``, by
        name; where landmarks were seen ``range_scale`` and ``depth_power`` too.
    windows, readings
        How many of them it rests on.
    rows
        What was fitted, by recording.
    delay_cost
        (D,) mean squared turn rate in (rad/s)^2 that each of ``DELAYS_S`` leaves, summed over recordings.
    """

    estimates: Mapping[str, Estimate]
    windows: int
    readings: int
    rows: tuple[DriveRows, ...]
    delay_cost: FloatArray

    def __getitem__(self, name: str) -> float:
        return self.estimates[name].value

    def parameters(self) -> dict[str, object]:
        """As parameters of the localizer ``ekf-gauss-markov``."""
        drive: dict[str, object] = {
            "commands": {
                "delay_s": round(self["delay_s"], 3),
                "speed_gain": round(self["speed_gain"], 4),
                "speed_loss_per_rad_s": round(max(self["speed_loss_per_rad_s"], 0.0), 4),
                "loss_up_to_rad_s": LOSS_UP_TO_RAD_S,
                "turn_gain": round(self["turn_gain"], 4),
                "bend_rad_per_m": round(self["bend_rad_per_m"], 4),
            }
        }
        if "range_scale" not in self.estimates:
            return drive
        return drive | {
            "range_scale": round(self["range_scale"], 4),
            "depth_power": round(min(max(self["depth_power"], 0.0), 2.0), 3),
        }


def calibrate_commands(logs: Sequence[MrclamLog]) -> DriveCommands:
    """Fit the map from commands to motion, and the range readings, over several recordings at once.

    Raises
    ------
    InputError
        Where the recordings hold too little to learn from.
    """
    delay, delay_cost = _delay(logs)
    rows = tuple(drive_rows(log, delay.value, number) for number, log in enumerate(logs))
    windows = np.concatenate([one.windows for one in rows])
    ratio, cosine = (np.concatenate([getattr(r, n) for r in rows]) for n in ("log_ratio", "log_cosine"))
    sees = any(len(log.landmarks.ids) for log in logs)
    if windows.shape[0] < MIN_WINDOWS or (sees and ratio.shape[0] < MIN_READINGS):
        seen = f" and {MIN_READINGS} readings of landmarks, found {windows.shape[0]} and {ratio.shape[0]}"
        raise InputError(
            f"calibrate commands: expected {MIN_WINDOWS} windows of 2 s with truth"
            + (seen if sees else f", found {windows.shape[0]}")
        )
    claimed_v, claimed_w, lost, v, w = windows.T
    if np.ptp(claimed_v) < 1e-6 or np.ptp(claimed_w) < 1e-6:
        raise InputError("calibrate commands: expected commands that change, found the same all the time")
    minutes = np.concatenate([one.minutes for one in rows])
    speed = _fit(np.column_stack([claimed_v, -lost]), v, minutes)
    turn = _fit(np.column_stack([claimed_w, v]), w, minutes)
    estimates = {
        "delay_s": delay,
        "speed_gain": speed[0],
        "speed_loss_per_rad_s": speed[1],
        "turn_gain": turn[0],
        "bend_rad_per_m": turn[1],
    }
    readings = 0
    if sees:
        near = np.abs(ratio - np.median(ratio)) < MISREAD
        reading_minutes, readings = np.concatenate([one.reading_minutes for one in rows]), int(near.sum())
        design = np.column_stack([np.ones(readings), cosine[near]])
        log_scale, power = _fit(design, ratio[near], reading_minutes[near])
        scale = (float(np.exp(x)) for x in (log_scale.value, log_scale.low, log_scale.high))
        estimates |= {"range_scale": Estimate(*scale), "depth_power": power}
    return DriveCommands(estimates, windows.shape[0], readings, rows, delay_cost)


def _fit(design: FloatArray, target: FloatArray, minutes: IntArray) -> list[Estimate]:
    """Estimates of the coefficients, with the wider of the intervals by minutes and by recordings."""
    recordings = minutes // DriveRows.MINUTES
    by_minute = clustered_least_squares(design, target, minutes)
    if np.unique(recordings).size < MIN_RECORDINGS:
        return [by_minute.estimate(i) for i in range(design.shape[1])]
    by_recording = clustered_least_squares(design, target, recordings)
    return [_wider(by_minute, by_recording, i) for i in range(design.shape[1])]


def _wider(one: ClusteredFit, other: ClusteredFit, index: int) -> Estimate:
    return max((one.estimate(index), other.estimate(index)), key=lambda found: found.high - found.low)


def _delay(logs: Sequence[MrclamLog]) -> tuple[Estimate, FloatArray]:
    """The delay of the grid that leaves least, its interval (jackknife), and what each delay leaves."""
    sums = [residual_turns(log, DELAYS_S) for log in logs]
    cost = np.asarray(
        sum((s / max(s[-1], 1.0) for s in (m.sum(axis=0) for m in sums)), np.zeros(len(DELAYS_S) + 1))
    )
    best = float(DELAYS_S[int(np.argmin(cost[:-1]))])
    minutes = np.concatenate(sums)
    if minutes.shape[0] < 2:
        return Estimate(best, 0.0, float(DELAYS_S[-1])), cost[:-1]
    std = jackknife_std(minutes, lambda total: _lowest(total[:-1]))
    found = normal_estimate(_lowest(minutes.sum(axis=0)[:-1]), std, minutes.shape[0] - 1)
    # The value is the grid's, which says no more than half a step to either side.
    half = 0.5 * float(DELAYS_S[1] - DELAYS_S[0])
    return Estimate(best, max(min(found.low, best - half), 0.0), max(found.high, best + half)), cost[:-1]


def _lowest(cost: FloatArray) -> float:
    """Where the parabola through the lowest point of the grid and its neighbours is lowest."""
    i = int(np.argmin(cost))
    step = float(DELAYS_S[1] - DELAYS_S[0])
    if i in (0, len(cost) - 1):
        return float(DELAYS_S[i])
    left, here, right = (float(x) for x in cost[i - 1 : i + 2])
    bow = left - 2.0 * here + right
    return float(DELAYS_S[i]) + (0.5 * step * (left - right) / bow if bow > 0.0 else 0.0)
