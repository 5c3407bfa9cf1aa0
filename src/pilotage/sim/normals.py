"""Standard normals one by one, drawn in blocks: a call of the generator costs more than the number."""

from __future__ import annotations

import numpy as np

BLOCK = 1024


class Normals:
    """A stream of standard normals."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._block: list[float] = []

    def next(self) -> float:
        """The next one."""
        if not self._block:
            self._block = self._rng.standard_normal(BLOCK)[::-1].tolist()
        return self._block.pop()
