"""Dead reckoning by encoders and a gyroscope with a reference, as MATLAB files: ``DR`` beside ``GT``.

``GT`` has rows of t, x, y, heading (s, m, m, rad); ``DR`` rows of t, distance, turn (s, m, rad) since the row
before. The CMU range-only recordings have this form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.mat import load_mat
from pilotage.logs.text import LARGEST_TIME_S

MIN_ROWS = 10
LARGEST = 1e6
"""Metres and radians beyond which a file is damaged."""
MAX_GAP_S = 2.0
"""Where the reference has no pose for longer, its heading in between is not known."""


@dataclass(frozen=True, slots=True)
class ReckoningLog:
    """Turns that a gyroscope claims, with the turns of the reference over the same steps.

    Attributes
    ----------
    t_s, dt_s
        (N,) end and length of each step.
    turn_rad
        (N,) as the gyroscope has it.
    reference_turn_rad
        (N,) as the reference has it; nan where it has a gap.
    """

    name: str
    t_s: FloatArray
    dt_s: FloatArray
    turn_rad: FloatArray
    reference_turn_rad: FloatArray


def read_reckoning_mat(path: Path) -> ReckoningLog:
    """Read a recording.

    Raises
    ------
    InputError
        Where it is no such file, or its numbers or times are not what they should be.
    """
    content = load_mat(path, ("GT", "DR"))
    truth, steps = _table(path, content, "GT", 4), _table(path, content, "DR", 3)
    t_s = steps[:, 0]
    # The first row's step begins with the reference, where that is earlier.
    begin = truth[0, 0] if truth[0, 0] < t_s[0] else t_s[0] - float(np.median(np.diff(t_s)))
    edges = np.concatenate([[begin], t_s])
    heading = np.interp(edges, truth[:, 0], np.unwrap(truth[:, 3]), left=math.nan, right=math.nan)
    after = np.clip(np.searchsorted(truth[:, 0], edges), 1, len(truth) - 1)
    heading[truth[after, 0] - truth[after - 1, 0] > MAX_GAP_S] = math.nan
    return ReckoningLog(path.stem.strip("_"), t_s, np.diff(edges), steps[:, 2], np.diff(heading))


def _table(path: Path, content: dict[str, object], name: str, columns: int) -> FloatArray:
    if name not in content:
        raise InputError(f"{path}: expected an array {name}, found none")
    table = np.asarray(content[name])
    if (
        table.ndim != 2
        or table.shape[1] != columns
        or table.shape[0] < MIN_ROWS
        or table.dtype.kind not in "fiu"
    ):
        raise InputError(
            f"{path}: expected {name} to have {MIN_ROWS} or more rows of {columns} numbers, "
            f"found shape {table.shape}"
        )
    table = table.astype(np.float64)
    within = np.abs(table) <= np.array([LARGEST_TIME_S, *[LARGEST] * (columns - 1)])
    bad = np.flatnonzero(~within.all(axis=1))
    if bad.size:
        raise InputError(
            f"{path}: {name} row {int(bad[0]) + 1}: expected finite numbers within {LARGEST:g}, "
            f"times within {LARGEST_TIME_S:g}"
        )
    backwards = np.flatnonzero(np.diff(table[:, 0]) <= 0.0)
    if backwards.size:
        raise InputError(f"{path}: {name} row {int(backwards[0]) + 2}: the time does not increase")
    return table
