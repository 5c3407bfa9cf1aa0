"""How a rate follows what is wanted of it."""

from __future__ import annotations


def approach(current: float, wanted: float, limit: float, change: float) -> float:
    """Move ``current`` towards ``wanted`` by at most ``change``, be it infinite, within +-limit."""
    target = min(max(wanted, -limit), limit)
    return min(max(target, current - change), current + change)
