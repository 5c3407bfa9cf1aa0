"""The rover under a continuous control law, integrated and sampled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-10, 1e-9
"""Of the integrator, in m and rad: a hundred thousand times finer than the millimetre that ends the drive."""
PAST = 0.01
"""Integrated until within this share of the tolerance, so that a sample falls before it."""


@dataclass(frozen=True, slots=True)
class SampledDrive:
    """A drive at equal steps of time.

    Attributes
    ----------
    t_s
        (N,) from 0.
    poses
        (N, 3) x, y, theta; theta is not wrapped.
    arrived
        Whether the last sample is within the tolerance.
    """

    t_s: FloatArray
    poses: FloatArray
    arrived: bool


def drive(
    command: Callable[[float, float, float], Twist],
    distance_m: Callable[[float, float], float],
    start: Pose2,
    sample_s: float,
    tolerance_m: float,
    limit_s: float,
) -> SampledDrive:
    """Integrate x' = v cos(theta), y' = v sin(theta), theta' = w until a sample is near enough.

    Explicit Runge-Kutta of order 8 with its own interpolation between steps (``scipy``'s DOP853, Hairer,
    Norsett and Wanner 1993).

    Parameters
    ----------
    command
        Twist at x, y, theta; the bicycle's equation 1.1 with w = v tan(gamma) / L.
    distance_m
        Distance from the goal at x, y.
    """
    from scipy.integrate import solve_ivp

    def flow(_t: float, state: FloatArray) -> list[float]:
        x, y, theta = float(state[0]), float(state[1]), float(state[2])
        twist = command(x, y, theta)
        return [twist.v_m_s * math.cos(theta), twist.v_m_s * math.sin(theta), twist.w_rad_s]

    def past_it(_t: float, state: FloatArray) -> float:
        return distance_m(float(state[0]), float(state[1])) - PAST * tolerance_m

    # At the goal itself its direction is not defined: the integration ends a little before it.
    past_it.terminal = True  # type: ignore[attr-defined]
    if distance_m(start.x_m, start.y_m) <= tolerance_m:
        return SampledDrive(np.zeros(1), start.as_array()[None, :], True)
    times = sample_s * np.arange(math.floor(limit_s / sample_s) + 1, dtype=np.float64)
    solution = solve_ivp(
        flow,
        (0.0, times[-1]),
        start.as_array(),
        method="DOP853",
        t_eval=times,
        events=past_it,
        rtol=RELATIVE_TOLERANCE,
        atol=ABSOLUTE_TOLERANCE,
    )
    poses = np.ascontiguousarray(solution.y.T)
    away = np.array([distance_m(float(x), float(y)) for x, y, _ in poses])
    near = np.flatnonzero(away <= tolerance_m)
    arrived = bool(near.size)
    if arrived:
        poses = poses[: near[0] + 1]
    return SampledDrive(times[: len(poses)], poses, arrived)
