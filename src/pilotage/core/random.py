"""One seed a run, one independent stream a consumer.

A stream is keyed by its name, not by the order of creation, so switching one module off does not
change what the others draw.
"""

from __future__ import annotations

import hashlib

import numpy as np


class RandomStreams:
    """Named, independent generators derived from one seed.

    Parameters
    ----------
    seed
        The run's seed, a non-negative integer.
    """

    def __init__(self, seed: int, prefix: str = "") -> None:
        if seed < 0:
            raise ValueError(f"seed must be >= 0, found {seed}")
        self.seed = seed
        self._prefix = prefix

    def within(self, name: str) -> RandomStreams:
        """The streams of one of several robots: the same names, other draws."""
        return RandomStreams(self.seed, f"{self._prefix}{name}/")

    def stream(self, name: str) -> np.random.Generator:
        """Return a fresh generator for ``name``; the same name gives the same draws."""
        key = int.from_bytes(hashlib.sha256(f"{self._prefix}{name}".encode()).digest()[:8], "little")
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence([self.seed, key])))
