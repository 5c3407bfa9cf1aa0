"""Memory that is free again, given back to the system."""

from __future__ import annotations

import ctypes


def give_back() -> None:
    """Hand the C library's free pages back to the system; nothing where it cannot (other than glibc).

    Arrays of some megabytes, made and dropped between small objects that stay, leave holes that glibc keeps:
    after closing the loops of a large building they are more than all that is in use.
    """
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return
    trim(0)
