"""The rounds of a robot with several goals: in which order, when it came to each, how good the order is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pilotage.records.numbers import number
from pilotage.report import quantities
from pilotage.report.markup import VALUE, Section, escape, section, table

SLUG, TITLE = "rounds", "The rounds"
EXACT = 1e-6
"""A share below this is rounding."""


def rounds_section(metrics: Mapping[str, Any]) -> Section:
    """The table of goals; left out where there are not several."""
    places, times = metrics.get("goals_m"), metrics.get("goals_reached_at_s")
    if not isinstance(places, list) or not isinstance(times, list) or len(places) < 2:
        return section(SLUG, TITLE)
    rows, before = [], 0.0
    for index, place in enumerate(places, start=1):
        x, y = (
            (number(value) for value in place)
            if isinstance(place, list) and len(place) == 2
            else (math.nan,) * 2
        )
        at_s = number(times[index - 1]) if index <= len(times) else math.nan
        reached = quantities.duration(at_s) if math.isfinite(at_s) else "not reached"
        took = quantities.duration(at_s - before) if math.isfinite(at_s) else quantities.NOTHING
        before = at_s if math.isfinite(at_s) else before
        rows.append((str(index), f"({x:.2f}, {y:.2f})", reached, took))
    columns = (("no.", ""), ("goal [m]", ""), ("reached after", VALUE), ("took", VALUE))
    return section(SLUG, TITLE, f"<p>{escape(_how_good(metrics))}</p>", table(columns, rows, "events"))


def _how_good(metrics: Mapping[str, Any]) -> str:
    """What the order is worth."""
    length, given = number(metrics.get("rounds_length_m")), number(metrics.get("rounds_given_m"))
    gap = number(metrics.get("rounds_gap"))
    if not math.isfinite(length):
        return "The goals in the order that was given; their numbers are those on the map."
    proven = (
        "the best order" if gap < EXACT else f"at most {100.0 * gap:.1f} % longer than the best order can be"
    )
    return (
        f"The robot chose the order by shortest paths on its own map: {quantities.length(length)}, {proven}; "
        f"{quantities.length(given)} in the order given. The numbers are those on the map."
    )
