"""A simulated robot with a laser among cylinders, as the arrays of an AER1513 file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
AHEAD_M = 0.22
CYLINDERS = 17


@dataclass(frozen=True)
class LaserEvents:
    """What befalls it; stretches are (begin, end) in seconds."""

    wrong_cylinders: float = 0.0
    """Share of the readings that are taken for another cylinder's."""
    range_error_std_m: float = 0.0
    """Of each cylinder, slowly varying (30 s), beside the white noise that the file tells."""
    blind_s: Sequence[tuple[float, float]] = ()
    standing_s: Sequence[tuple[float, float]] = ()
    missing_s: Sequence[tuple[float, float]] = ()
    """Rows left out of the file: time goes on, the robot too."""
    push_s: float | None = None
    """When it is moved by 0.5 m."""


QUIET = LaserEvents()


def laser_drive(seed: int = 0, rows: int = 3000, events: LaserEvents = QUIET) -> dict[str, Any]:
    """A drive at 10 Hz with white noise as the file says: 17 cylinders, a laser 0.22 m ahead of the axle."""
    rng = np.random.default_rng(seed)
    t: FloatArray = 0.1 * np.arange(rows, dtype=np.float64)
    pose, poses = np.array([2.0, 0.0, 0.0]), []
    v = 0.2 + 0.1 * np.sin(0.01 * np.arange(rows))
    om = 0.12 + 0.15 * np.sin(0.03 * np.arange(rows))
    still = within(events.standing_s, t)
    v[still] = om[still] = 0.0
    for k in range(rows):
        if k:
            middle = pose[2] + 0.05 * om[k]
            pose = pose + 0.1 * np.array([v[k] * np.cos(middle), v[k] * np.sin(middle), om[k]])
        if events.push_s is not None and k == round(10.0 * events.push_s):
            pose = pose + np.array([0.3, -0.4, 0.0])
        poses.append(pose)
    truth = np.array(poses)
    # Cylinders all over where it drives.
    low, high = truth[:, :2].min(axis=0) - 1.0, truth[:, :2].max(axis=0) + 1.0
    points = rng.uniform(low, high, (CYLINDERS, 2))
    laser = truth[:, :2] + AHEAD_M * np.column_stack([np.cos(truth[:, 2]), np.sin(truth[:, 2])])
    offset = points[None] - laser[:, None]
    r = np.hypot(offset[..., 0], offset[..., 1]) + rng.normal(0.0, 0.03, (rows, CYLINDERS))
    b = np.arctan2(offset[..., 1], offset[..., 0]) - truth[:, 2:] + rng.normal(0.0, 0.026, (rows, CYLINDERS))
    unseen = (r < 0.3) | (r > 5.0) | (rng.random((rows, CYLINDERS)) < 0.3)
    if events.range_error_std_m > 0.0:
        r += slow(rng, rows, events.range_error_std_m)
    wrong = rng.random(rows) if events.wrong_cylinders > 0.0 else np.ones(rows)
    for row in np.flatnonzero(wrong < events.wrong_cylinders * CYLINDERS):
        one, other = rng.choice(CYLINDERS, 2, replace=False)
        r[row, one], b[row, one] = r[row, other], b[row, other]
    r[unseen | within(events.blind_s, t)[:, None] | (r <= 0.05)] = 0.0
    arrays: dict[str, Any] = {
        "t": t,
        "r": r,
        "b": (b + np.pi) % (2 * np.pi) - np.pi,
        "v": v + rng.normal(0.0, 0.066, rows),
        "om": om + rng.normal(0.0, 0.09, rows),
        "x_true": truth[:, 0],
        "y_true": truth[:, 1],
        "th_true": (truth[:, 2] + np.pi) % (2 * np.pi) - np.pi,
    }
    kept = ~within(events.missing_s, t)
    arrays = {name: column(x[kept]) if x.ndim == 1 else x[kept] for name, x in arrays.items()}
    return arrays | {
        "l": points,
        "d": AHEAD_M,
        "r_var": 0.03**2,
        "b_var": 0.026**2,
        "v_var": 0.066**2,
        "om_var": 0.09**2,
    }


def column(values: Any) -> FloatArray:
    """(N, 1), as MATLAB has it."""
    return np.asarray(values, dtype=np.float64).reshape(-1, 1)


def within(stretches: Sequence[tuple[float, float]], t: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether a time lies in one of the stretches."""
    inside = np.zeros(t.shape[0], dtype=bool)
    for begin, end in stretches:
        inside |= (t >= begin) & (t < end)
    return inside


def slow(rng: np.random.Generator, rows: int, std: float) -> FloatArray:
    """(N, 17) first-order Gauss-Markov errors with a time constant of 30 s."""
    keep = np.exp(-0.1 / 30.0)
    out = np.empty((rows, CYLINDERS))
    out[0] = rng.normal(0.0, std, CYLINDERS)
    for k in range(1, rows):
        out[k] = keep * out[k - 1] + rng.normal(0.0, std * np.sqrt(1.0 - keep**2), CYLINDERS)
    return out
