"""Rows of numbers that grow, for what is gathered over a run."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from pilotage.core.types import FloatArray, IntArray

Array = TypeVar("Array", FloatArray, IntArray)


class Rows:
    """Rows of numbers that grow."""

    def __init__(self, width: int, room: int = 8192) -> None:
        self._values: FloatArray = np.zeros((room, width))
        self.count = 0

    def add(self, row: tuple[float, ...]) -> None:
        """Add one."""
        if self.count == self._values.shape[0]:
            self._values = doubled(self._values)
        self._values[self.count] = row
        self.count += 1

    @property
    def values(self) -> FloatArray:
        """(count, width)."""
        return self._values[: self.count]


def doubled(values: Array) -> Array:
    """The same with as much room again."""
    return np.concatenate([values, np.zeros_like(values)])
