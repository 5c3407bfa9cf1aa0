"""Standard normals for sensors that draw many at once: several sensors', each from its own stream."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray


class NoiseBlocks:
    """Blocks of standard normals, drawn some ahead: what a sensor draws is what it would draw one by one.

    Attributes
    ----------
    values
        (sensors, blocks, *shape) standard normals.
    """

    def __init__(self, rngs: Sequence[np.random.Generator], blocks: int, shape: tuple[int, ...]) -> None:
        self._rngs, self._blocks = rngs, blocks
        self.values: FloatArray = np.zeros((len(rngs), blocks, *shape))
        self._at = blocks - 1

    def next(self) -> int:
        """The block to take now."""
        self._at += 1
        if self._at == self._blocks:
            for rng, block in zip(self._rngs, self.values, strict=True):
                rng.standard_normal(out=block)
            self._at = 0
        return self._at
