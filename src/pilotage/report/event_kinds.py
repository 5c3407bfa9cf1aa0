"""How each kind of event is called and drawn, and which of them happened at a place worth marking."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.report.style import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, VERMILLION


@dataclass(frozen=True, slots=True)
class EventKind:
    """Name in plain words, colour, and whether the map marks where it happened."""

    name: str
    colour: str
    on_map: bool


_KINDS = {
    "plan": EventKind("plan", BLUE, False),
    "replan": EventKind("replan", PURPLE, True),
    "avoid-start": EventKind("avoidance begins", ORANGE, True),
    "avoid-end": EventKind("avoidance ends", ORANGE, False),
    "escape": EventKind("backs out", VERMILLION, True),
    "wait": EventKind("waits among people", SKY, True),
    "hall": EventKind("narrow hall", BLUE, True),
    "arrived": EventKind("arrived", GREEN, False),
    "collision": EventKind("collision", VERMILLION, True),
    "stuck": EventKind("stuck", VERMILLION, True),
    "failed": EventKind("failed", VERMILLION, True),
    "kidnap": EventKind("carried elsewhere", VERMILLION, True),
    "look-around": EventKind("looks around first", ORANGE, False),
    "lost": EventKind("lost, wandering", ORANGE, True),
    "found": EventKind("found itself", GREEN, True),
    "closure": EventKind("loops closed", BLUE, False),
    "close": EventKind("goes back to close a loop", PURPLE, True),
    "stall": EventKind("gives a place up", ORANGE, True),
    "explored": EventKind("nothing left to explore", GREEN, True),
    "no-odometry": EventKind("no odometry", ORANGE, False),
    "cut-off": EventKind("floor left out", ORANGE, False),
    "obstacle-mapped": EventKind("obstacle mapped", MUTED, False),
}


def event_kind(slug: str) -> EventKind:
    """Return how to show a kind; one that is not known by name is shown under its own slug."""
    return _KINDS.get(slug) or EventKind(slug.replace("-", " "), INK, True)
