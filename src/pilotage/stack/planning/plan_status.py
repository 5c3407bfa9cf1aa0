"""How a planning query ended, over cells or on a field."""

from __future__ import annotations

from enum import StrEnum


class PlanStatus(StrEnum):
    """How a planning query ended."""

    FOUND = "found"
    NO_PATH = "no path"
    START_BLOCKED = "start blocked"
    GOAL_BLOCKED = "goal blocked"
