"""The rounds of a robot with several goals: in which order, when it came to each, how good the order is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pilotage.records.numbers import number
from pilotage.report import quantities
from pilotage.report.markup import escape

SLUG, TITLE = "rounds", "The rounds"
EXACT = 1e-6
"""A share below this is rounding."""


def rounds_section(metrics: Mapping[str, Any]) -> str:
    """Return the table of goals; empty where there are not several."""
    places, times = metrics.get("goals_m"), metrics.get("goals_reached_at_s")
    if not isinstance(places, list) or not isinstance(times, list) or len(places) < 2:
        return ""
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
        rows.append(
            f'<tr><td>{index}</td><td>({x:.2f}, {y:.2f})</td><td class="value">{escape(reached)}</td>'
            f'<td class="value">{escape(took)}</td></tr>'
        )
    return (
        f'<section id="{SLUG}"><h2><a href="#{SLUG}">{TITLE}</a></h2><p>{escape(_how_good(metrics))}</p>'
        '<table class="events"><thead><tr><th scope="col">no.</th><th scope="col">goal [m]</th>'
        '<th scope="col" class="value">reached after</th><th scope="col" class="value">took</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></section>"
    )


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
