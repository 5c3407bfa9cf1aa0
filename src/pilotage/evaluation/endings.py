"""Why a run ended, in a word that can be counted over many of them."""

from __future__ import annotations

import re
from collections.abc import Mapping

COMPLETE = "complete"
_OWN = re.compile(r"[:;,(\d]| (?:at|after|of|within) ")
"""What begins here in a reason is this run's alone: places, times, counts."""
_WORDS = {"got stuck": "stuck", "blocked by an obstacle": "blocked", "time limit": "time"}


def ending_of(metrics: Mapping[str, object]) -> str:
    """``complete`` for a success, else the run's ``reason`` without its own numbers; empty without one.

    A run is ``complete`` by its task's verdict: one that says it is done and touched a box is not.
    """
    if metrics.get("success") is True or metrics.get("success") == 1.0:
        return COMPLETE
    reason = metrics.get("reason")
    if not isinstance(reason, str):
        return ""
    words = _OWN.split(reason, maxsplit=1)[0].strip()
    return _WORDS.get(words, words)
