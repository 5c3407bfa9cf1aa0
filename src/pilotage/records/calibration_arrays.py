"""The arrays beside an answer of ``pilotage calibrate``: those that its page draws, each of its shape."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.arrays import Arrays

LATEST_S = 1e12
LARGEST_LOGARITHM = 50.0
"""Of a ratio: its exponential is a number that can be drawn."""
READINGS = "/magnetometer/values"

Found = dict[str, FloatArray]


def require_arrays(archive: Arrays, answer: Mapping[str, Any]) -> Found:
    """Take out what belongs to an answer that was looked over before.

    Raises
    ------
    ValueError
        Where an array is missing, of another shape, or holds a number that nothing measures.
    """
    return _OF_KIND[answer["calibration"]](archive, answer)


def _odometry(archive: Arrays, answer: Mapping[str, Any]) -> Found:
    out: Found = {}
    for i in range(len(answer["logs"])):
        out[f"{i}/t_s"] = t_s = archive.finite(f"{i}/t_s", -1, most=LATEST_S)
        _require_some(t_s, f"{i}/t_s")
        for name, *columns in (("truth", 3), ("claimed", 3), ("distance_error_m",), ("angle_error_rad",)):
            out[f"{i}/{name}"] = archive.finite(f"{i}/{name}", t_s.size, *columns)
    return out


def _commands(archive: Arrays, answer: Mapping[str, Any]) -> Found:
    delays_s = archive.finite("delays_s", -1)
    cost = archive.finite("delay_cost", delays_s.size)
    _require_some(delays_s, "delays_s")
    if not bool((cost >= 0.0).all()):
        raise ValueError("delay_cost: expected numbers from 0 on")
    out: Found = {"delays_s": delays_s, "delay_cost": cost}
    for i in range(len(answer["logs"])):
        out[f"{i}/windows"] = archive.finite(f"{i}/windows", -1, 5)
        ratio = archive.finite(f"{i}/log_ratio", -1, most=LARGEST_LOGARITHM)
        out[f"{i}/log_ratio"] = ratio
        out[f"{i}/log_cosine"] = archive.finite(f"{i}/log_cosine", ratio.size, most=LARGEST_LOGARITHM)
    read = sum(out[f"{i}/log_ratio"].size for i in range(len(answer["logs"])))
    if answer.get("range_scale") is not None and not read:
        raise ValueError("log_ratio: expected the readings that the range's scale was found from, found none")
    return out


def _range(archive: Arrays, answer: Mapping[str, Any]) -> Found:
    out = {str(i): archive.finite(str(i), -1) for i in range(len(answer["sensors"]))}
    for name, values in out.items():
        _require_some(values, name)
    return out


def _heading(archive: Arrays, answer: Mapping[str, Any]) -> Found:
    out = {name: archive.finite(name, -1, 3) for name in archive.names() if name.endswith(READINGS)}
    for i in range(len(answer.get("gyroscope_while_driving") or ())):
        out[f"drive-{i}/t_s"] = t_s = archive.finite(f"drive-{i}/t_s", -1, most=LATEST_S)
        out[f"drive-{i}/drift_rad"] = archive.floats(f"drive-{i}/drift_rad", t_s.size)  # nan in gaps
    for name, values in out.items():
        _require_some(values, name)
    return out


def _require_some(values: FloatArray, name: str) -> None:
    if not np.size(values):
        raise ValueError(f"{name}: expected at least one row, found none")


_OF_KIND: Mapping[str, Callable[[Arrays, Mapping[str, Any]], Found]] = {
    "odometry": _odometry,
    "commands": _commands,
    "range": _range,
    "heading": _heading,
}
