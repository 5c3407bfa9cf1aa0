"""Memory that is free again, given back to the system, and how often Python looks for it."""

from __future__ import annotations

import gc

SELDOM = 50_000, 10, 10
"""New objects between two looks for garbage, and how many looks make a longer one: Python's first is 700."""


def look_seldom() -> None:
    """Look for garbage less often, in a process of our own.

    It took a tenth of a run's time; almost all that is dropped goes by counting, so no more memory is needed.
    """
    gc.set_threshold(*SELDOM)


def give_back() -> None:
    """Hand the C library's free pages back to the system; nothing where it cannot (other than glibc).

    Arrays of some megabytes, made and dropped between small objects that stay, leave holes that glibc keeps:
    after closing the loops of a large building they are more than all that is in use.
    """
    import ctypes  # not for every command

    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return
    trim(0)
