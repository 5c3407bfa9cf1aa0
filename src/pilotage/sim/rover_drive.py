"""The rover under a continuous control law, integrated and sampled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-10, 1e-9
"""Of the integrator, in m and rad: a hundred thousand times finer than the millimetre that ends the drive."""


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

    Raises
    ------
    RuntimeError
        Where the integrator's step falls below what floats can tell apart.
    """
    from scipy.integrate import DOP853

    def flow(_t: float, state: FloatArray) -> FloatArray:
        x, y, theta = float(state[0]), float(state[1]), float(state[2])
        twist = command(x, y, theta)
        return np.array([twist.v_m_s * math.cos(theta), twist.v_m_s * math.sin(theta), twist.w_rad_s])

    last = max(1, math.floor(limit_s / sample_s))
    poses, k = [start.as_array()[None, :]], 0
    arrived = distance_m(start.x_m, start.y_m) <= tolerance_m
    solver = DOP853(
        flow, 0.0, start.as_array(), last * sample_s, rtol=RELATIVE_TOLERANCE, atol=ABSOLUTE_TOLERANCE
    )
    # Step by step: beyond the goal the bearing to it is rounding, and the integrator would chase that.
    while not arrived and k < last:
        failure = solver.step()
        if solver.status == "failed":
            raise RuntimeError(f"the integrator gave up at {solver.t:g} s: {failure}")
        end = last if solver.status == "finished" else min(last, math.floor(solver.t / sample_s))
        if end == k:
            continue
        new = solver.dense_output()(np.arange(k + 1, end + 1) * sample_s).T
        near = np.flatnonzero([distance_m(x, y) <= tolerance_m for x, y, _ in new.tolist()])
        if near.size:
            arrived = True
            new = new[: near[0] + 1]
        poses.append(new)
        k = end
    table = np.concatenate(poses)
    return SampledDrive(sample_s * np.arange(len(table), dtype=np.float64), table, arrived)
