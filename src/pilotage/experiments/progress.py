"""Where a run stands, for a progress line."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """Simulated time, and the numbers that tell most about a run of its kind: (label, text) each."""

    t_s: float
    numbers: tuple[tuple[str, str], ...]


OnProgress = Callable[[Progress], None]
EVERY_S = 0.1
"""Wall time between two progress messages."""


def metres(value: float, digits: int) -> str:
    """A length for the progress line, in a fixed width; a dash where there is none."""
    return f"{value:>6.{digits}f} m" if math.isfinite(value) else f"{'-':>6} m"
