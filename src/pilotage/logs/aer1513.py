"""A robot with a laser among cylinders, as one MATLAB file (the format of Barfoot's course AER1513).

Arrays: ``t`` (K,), ``r`` and ``b`` (K, L) range and bearing of every landmark from the laser, r = 0 where
one was not seen; ``v`` and ``om`` (K,) measured speed and turn rate; ``l`` (L, 2) the landmarks;
``x_true``, ``y_true``, ``th_true`` (K,); ``d`` distance of the laser ahead of the axle; ``r_var``,
``b_var``, ``v_var``, ``om_var``. ``true_valid`` (K,), where it is there, is 0 in rows whose truth is not
known.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.config import SMALLEST
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.logs.mat import load_mat

SERIES = ("t", "v", "om", "x_true", "y_true", "th_true")
NUMBERS = ("d", "r_var", "b_var", "v_var", "om_var")
KNOWN = "true_valid"
MIN_ROWS = 10
LARGEST, LARGEST_TIME = 1e6, 1e12
"""Metres, radians and seconds beyond which a file is damaged."""


@dataclass(frozen=True, slots=True)
class Aer1513Log:
    """The arrays by their meaning; ranges and bearings (K, L) are nan where nothing was seen."""

    t_s: FloatArray
    speed_m_s: FloatArray
    turn_rate_rad_s: FloatArray
    truth: FloatArray
    truth_known: BoolArray
    ranges_m: FloatArray
    bearings_rad: FloatArray
    points_xy_m: FloatArray
    laser_ahead_m: float
    range_var_m2: float
    bearing_var_rad2: float
    speed_var_m2_s2: float
    turn_rate_var_rad2_s2: float


def read_aer1513(path: Path) -> Aer1513Log:
    """Read a recording.

    Raises
    ------
    InputError
        The array, and its row, where something is missing, of the wrong shape, not finite or backward.
    """
    content = load_mat(path, (*SERIES, *NUMBERS, "r", "b", "l", KNOWN))
    missing = [name for name in (*SERIES, "r", "b", "l", *NUMBERS) if name not in content]
    if missing:
        raise InputError(
            f"{path}: expected the arrays of an AER1513 recording, missing: {', '.join(missing)}"
        )
    t_s = _finite(path, "t", _array(path, content, "t").reshape(-1))
    rows = t_s.shape[0]
    if _array(path, content, "t").ndim > 2:
        raise InputError(f"{path}: t: expected a column, found shape {_array(path, content, 't').shape}")
    if rows < MIN_ROWS:
        raise InputError(f"{path}: t: expected {MIN_ROWS} or more rows, found {rows}")
    backward = np.flatnonzero(np.diff(t_s) <= 0.0)
    if backward.size:
        raise InputError(f"{path}: t row {int(backward[0]) + 2}: the time does not increase")
    points = _finite(path, "l", _array(path, content, "l"))
    if points.ndim != 2 or points.shape[1] != 2 or points.shape[0] == 0:
        raise InputError(f"{path}: l: expected (L, 2) landmarks, found shape {points.shape}")
    known = np.ones(rows, dtype=bool)
    if KNOWN in content:
        known = _finite(path, KNOWN, _shaped(path, content, KNOWN, (rows,)).reshape(-1)) != 0.0
    series = {
        name: _finite(path, name, _shaped(path, content, name, (rows,)), known if "true" in name else None)
        for name in SERIES
    }
    shape = (rows, points.shape[0])
    ranges = _finite(path, "r", _shaped(path, content, "r", shape)).copy()
    bearings = _finite(path, "b", _shaped(path, content, "b", shape), where=ranges != 0.0).copy()
    negative = np.flatnonzero((ranges < 0.0).any(axis=1))
    if negative.size:
        raise InputError(f"{path}: r row {int(negative[0]) + 1}: expected ranges >= 0, found a negative one")
    unseen = ranges == 0.0
    ranges[unseen] = bearings[unseen] = np.nan
    ahead, *variances = (float(_finite(path, n, _shaped(path, content, n, (1,)))[0]) for n in NUMBERS)
    for name, value in zip(NUMBERS[1:], variances, strict=True):
        if not value >= SMALLEST:
            raise InputError(f"{path}: {name}: expected a variance of {SMALLEST:g} or more, found {value:g}")
    truth = np.column_stack([series["x_true"], series["y_true"], series["th_true"]])
    return Aer1513Log(
        t_s, series["v"], series["om"], truth, known, ranges, bearings, points, ahead, *variances
    )


def _array(path: Path, content: dict[str, object], name: str) -> FloatArray:
    values = np.asarray(content[name])
    if values.dtype.kind not in "fiu":
        found = "cells or a structure" if values.dtype.kind == "O" else values.dtype
        raise InputError(f"{path}: {name}: expected numbers, found {found}")
    return values.astype(np.float64)


def _shaped(path: Path, content: dict[str, object], name: str, shape: tuple[int, ...]) -> FloatArray:
    values = _array(path, content, name)
    flat = values.reshape(-1) if len(shape) == 1 else values
    if flat.shape != shape:
        raise InputError(f"{path}: {name}: expected shape {shape}, found {values.shape}")
    return flat


def _finite(path: Path, name: str, values: FloatArray, where: object = None) -> FloatArray:
    limit = LARGEST_TIME if name == "t" else LARGEST
    wrong = ~np.isfinite(values) | (np.abs(values) > limit)
    if where is not None:
        wrong &= np.asarray(where)
    bad = np.flatnonzero(wrong.any(axis=tuple(range(1, wrong.ndim))))
    if bad.size:
        raise InputError(f"{path}: {name} row {int(bad[0]) + 1}: expected a finite number within {limit:g}")
    return values
