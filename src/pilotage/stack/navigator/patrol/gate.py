"""A place that a robot drives through on its way to the next one, as the dynamic window prices it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import eikonal, voronoi_window
from pilotage.kernels.geometry.field import Field
from pilotage.stack.patrol.roadmap import Roadmap

NO_GATE: voronoi_window.Gate = ((np.zeros((2, 2)), 0.0, 0.0, 1.0), 0.0, 0.0, -1.0, 0.0)
THROUGH_RAD = 1.75
"""It drives through a place where it turns by no more than this."""

Around: TypeAlias = Callable[[FloatArray], Field]
"""A field of the roadmap led around who is in the way."""


def gate_at(
    roadmap: Roadmap,
    at: FloatArray,
    came_from: int,
    then: int,
    near_m: float,
    turn_s_per_rad: float,
    around: Around,
) -> voronoi_window.Gate:
    """The place ``at`` (2,) between two vertices; none where it turns sharply there or nothing leads on.

    Parameters
    ----------
    near_m
        How near to it is there.
    turn_s_per_rad
        What a turn costs.
    """
    x, y = at.tolist()
    on = roadmap.time_s(then)
    away = eikonal.descent(x, y, roadmap.placed(on))
    back = eikonal.descent(x, y, roadmap.placed(roadmap.time_s(came_from)))
    turn_rad = math.acos(min(1.0, max(-1.0, -away[0] * back[0] - away[1] * back[1])))
    if turn_rad > THROUGH_RAD:
        return NO_GATE
    field = around(on)
    left_s = eikonal.value_at(x, y, field, 0.0)
    if not math.isfinite(left_s):
        return NO_GATE
    # The turn is to be made, sooner or later: who puts it off has not been spared it.
    return field, x, y, near_m, left_s + turn_s_per_rad * turn_rad
