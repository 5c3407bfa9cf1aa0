"""What of a floor its passages are too narrow for."""

from __future__ import annotations

from pilotage.core.types import Event
from pilotage.maps.floor import Floor

MUCH = 0.05
"""Share of a floor that is told when it is left out."""


def cut_off(floor: Floor) -> list[Event]:
    """An event where a body is too wide for the way to much of a floor; else none."""
    left_out = floor.cut_off_fraction
    if left_out < MUCH:
        return []
    return [
        Event(
            0.0,
            "cut-off",
            f"{100.0 * left_out:.0f} % of the floor is left out: no passage wide enough for a body "
            f"{2.0 * floor.radius_m:.2f} m across leads there",
        )
    ]
