"""A query asked once before it is timed: a kernel's first call compiles it or loads it from the cache."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from pilotage.kernels.code_cache import cache_is_cold

Answer = TypeVar("Answer")

LONG_S = 5.0
"""A query that takes longer is not asked twice: its time is that of planning anyway."""
_REHEARSED: set[tuple[str, ...]] = set()


def rehearsed(key: tuple[str, ...], ask: Callable[[], Answer]) -> Answer:
    """Ask, a process's first time for ``key`` twice, so that the answer's times are no compiler's.

    Where nothing is compiled yet the first time says nothing about how long the query takes.

    Parameters
    ----------
    ask
        Gives the same each time but for its clocks: what it draws from begins anew.
    """
    if key in _REHEARSED:
        return ask()
    cold, begun_s = cache_is_cold(), time.perf_counter()
    first = ask()
    _REHEARSED.add(key)
    return first if not cold and time.perf_counter() - begun_s > LONG_S else ask()
