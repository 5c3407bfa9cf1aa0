"""A bag's gyroscope as rates of a recorded drive's steps; one that measures other turns is told."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.bag_kinds import RATES
from pilotage.logs.bag_series import has, mount_matrix, read_series
from pilotage.logs.laser_log import interpolate_poses
from pilotage.sensors.gyroscope import GyroscopeConfig

SHEET = GyroscopeConfig(
    rate_hz=100.0, bias_rad_s=0.01, bias_walk_rad_s_sqrt_s=1e-4, scale_error=0.01, rate_std_rad_s=0.01
)
"""Of a gyroscope that nobody has calibrated: a cheap one, its bias at rest taken off at some time."""
SILENT_S = 0.5
"""Over longer gaps nothing is known of the turn."""
WINDOW_S = 1.0
LEAST_WINDOWS, LEAST_TURN_RAD = 5, 0.15
"""Turns are compared over so many windows, where the wheels' turns are on the mean as large."""
MOST_APART, MOST_BIAS_RAD = 0.7, 0.1
"""How far both may be apart as a share of the turns, for wheels may err by much, the bias taken off; and the
largest bias in a window."""


def bag_gyroscope(
    log: Path,
    topic: str | None,
    bases: tuple[str, ...],
    clock: FloatArray,
    wheels: tuple[FloatArray, FloatArray],
    said: list[str],
) -> tuple[str, FloatArray] | None:
    """Topic and mean rate (K,) about the vertical over steps that end at ``clock`` (K,), nan where unknown.

    Rates are turned into the robot's frame by the transforms; without any the sensor's z is taken for up.

    Parameters
    ----------
    topic
        The one asked for; None: the usual one, and where it does not fit the odometry none at all.
    bases
        Frames that the robot may have.
    wheels
        Times (M,) and poses (M, 3) of the odometry, to compare with.
    said
        Takes what was chosen, and why not.

    Raises
    ------
    InputError
        Where the one asked for is not there, or turns otherwise than the odometry.
    """
    if topic is None and not has(log, RATES):
        return None
    told = read_series(log, RATES, topic)
    matrix = next((m for base in bases if (m := mount_matrix(log, base, told.frame)) is not None), None)
    if matrix is None:
        said.append(
            f"no transforms from {' or '.join(bases)} to the frame '{told.frame}' of {told.topic}: its z is "
            "taken to point up"
        )
        rates = told.values[:, 2]
    else:
        rates = told.values @ matrix[2, :3]
    if len(rates) < 2:
        return None
    wrong = _unlike(told.t_s, rates, wheels)
    if wrong:
        problem = f"{told.topic} does not turn as the odometry does ({wrong}); is its z up, in rad/s?"
        if topic is not None:
            raise InputError(f"{log}: expected the robot's turn rates, found that {problem}")
        said.append(f"{problem} It is left out")
        return None
    said += told.warnings
    return told.topic, np.concatenate([[math.nan], _mean_rates(told.t_s, rates, clock)])


def _mean_rates(t_s: FloatArray, rates: FloatArray, clock: FloatArray) -> FloatArray:
    """(K - 1,) mean rate from each time of ``clock`` to the next; nan where a gap is in between."""
    steps = np.diff(t_s)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * steps)])
    unheard = np.concatenate([[0.0], np.cumsum(np.where(steps > SILENT_S, steps, 0.0))])
    turn, silent_s = np.diff(np.interp(clock, t_s, turned)), np.diff(np.interp(clock, t_s, unheard))
    inside = (clock[:-1] >= t_s[0]) & (clock[1:] <= t_s[-1]) & (silent_s == 0.0)
    return np.where(inside, turn / np.maximum(np.diff(clock), 1e-9), math.nan)


def _unlike(t_s: FloatArray, rates: FloatArray, wheels: tuple[FloatArray, FloatArray]) -> str:
    """In what the gyroscope's turns differ from the odometry's; '' where they do not, or nothing turned."""
    begin, end = max(t_s[0], wheels[0][0]), min(t_s[-1], wheels[0][-1])
    clock = np.arange(begin, end, WINDOW_S)
    if len(clock) <= LEAST_WINDOWS:
        return ""
    poses = interpolate_poses(*wheels, clock)
    own = wrap_array_to_pi(np.diff(poses[:, 2]))
    other = _mean_rates(t_s, rates, clock) * WINDOW_S
    known = np.isfinite(own) & np.isfinite(other)
    own, other = own[known], other[known]
    if len(own) < LEAST_WINDOWS or np.sqrt(np.mean(own**2)) < LEAST_TURN_RAD:
        return ""
    apart = other - own
    bias = float(np.clip(np.median(apart), -MOST_BIAS_RAD, MOST_BIAS_RAD))
    share = float(np.sqrt(np.mean((apart - bias) ** 2) / np.mean(own**2)))
    return "" if share <= MOST_APART else f"they are {100.0 * share:.0f} % of the turns apart"
