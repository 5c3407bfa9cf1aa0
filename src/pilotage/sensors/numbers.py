"""A reading as rows of numbers of fixed length, for whoever takes no other: policies that learn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import FloatArray, IntArray
from pilotage.models.motion.motion import MotionConfig

FARTHEST_M = 1e6
"""Bound of positions and distances in a map."""
MOTION_FACTOR = 4.0
"""Bound of what a sensor of motion reads: so many times what the drive can do, for slip and errors."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorSetting:
    """What a sensor is on, as far as the length and the bounds of its readings depend on it.

    Attributes
    ----------
    landmarks
        (L,) ids of those on the map.
    """

    motion: MotionConfig
    dt_s: float
    landmarks: IntArray


@dataclass(frozen=True, slots=True)
class Numbers:
    """Some numbers of every reading of a sensor.

    Attributes
    ----------
    name
        The reading's field, its unit in the name; ``part.x_m`` of a dataclass in a field.
    size
        How many there are.
    low, high
        Bounds.
    rest
        What stands for each before the sensor has spoken, and where a reading holds fewer than ``size``.
    of
        How they are taken from a reading; None: the field named.
    """

    name: str
    size: int = 1
    low: float = -math.inf
    high: float = math.inf
    rest: float = 0.0
    of: Callable[[Any], Any] | None = field(default=None, repr=False)

    def read(self, reading: object) -> FloatArray:
        """(N,) numbers of a reading, N up to ``size`` where it is as declared."""
        value = attrgetter(self.name)(reading) if self.of is None else self.of(reading)
        return np.zeros(0) if value is None else np.asarray(value, dtype=np.float64).reshape(-1)

    @staticmethod
    def around_zero(name: str, most: float, size: int = 1) -> Numbers:
        """Numbers of either sign."""
        return Numbers(name, size, -most, most)


def numbers_in(reading: object) -> tuple[Numbers, ...]:
    """Those that a reading holds, in the order of its fields; texts and whatever else are left out."""
    return tuple(
        Numbers(name, values.size, 0.0, 1.0) if values.dtype.kind == "b" else Numbers(name, values.size)
        for name, values in _numbers(reading, "")
    )


def _numbers(reading: object, before: str) -> Iterator[tuple[str, NDArray[Any]]]:
    if not is_dataclass(reading):
        return
    for one in fields(reading):
        name, value = before + one.name, getattr(reading, one.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{name}.")
            continue
        try:
            values = np.asarray(value)
        except ValueError:  # rows of several lengths
            continue
        if values.size and values.dtype.kind in "biuf":
            yield name, values
