"""How fast a robot on weak brakes may be, by what lies ahead on its way."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.control.straight_stop import speed_to_stop
from pilotage.kernels.geometry.field import Field
from pilotage.stack.patrol.roadmap import STEP_M, Roadmap

HORIZONS_S = 0.6, 0.9
"""Of arcs of who can stop within the first of them and while it reacts, and of whoever cannot."""


def horizon_s(top_m_s: float, braking_m_s2: float, reacts_s: float) -> float:
    """How long an arc of the dynamic window is, for a robot's brakes.

    It is driven at one speed and turn rate. In doors of 0.8 m and in rooms hardly larger than a body's turn a
    shorter one is of more use; weak brakes take the longer one to gain a speed that makes a difference.
    """
    short_s, long_s = HORIZONS_S
    return short_s if _is_stopped(top_m_s, braking_m_s2, short_s + reacts_s) else long_s


def _is_stopped(top_m_s: float, braking_m_s2: float, within_s: float) -> bool:
    """Whether it stops in what it drives within that time."""
    return top_m_s <= 2.0 * braking_m_s2 * within_s


class Approach:
    """The speed from which it slows down in time for what its way comes to.

    Commands are given where it can stop straight on from them, and arcs of the dynamic window are looked at
    no farther than its horizon: who takes longer to stop came to each door beside its path too fast to turn,
    and past it. Where there is room straight on, as on a wide floor, a bend slows it down by nothing.

    Parameters
    ----------
    top_m_s, braking_m_s2
        By the data sheet.
    horizon_s, reacts_s
        Of its arcs; how long it drives on between two looks. Who stops within both need do nothing.
    keep_m
        What its middle keeps from walls.

    Attributes
    ----------
    turns_back_s
        So long it takes to come to rest from its top speed, and back up to it.
    slow_m_s
        What it is short of this costs it the time to gain it: an arc of so weak a robot that can hardly set
        out leads as far as one that cannot.
    """

    def __init__(
        self, top_m_s: float, braking_m_s2: float, horizon_s: float, reacts_s: float, keep_m: float
    ) -> None:
        self._top_m_s, self._braking_m_s2 = top_m_s, braking_m_s2
        self._reacts_s, self._keep_m = reacts_s, keep_m
        self._stops_in_sight = _is_stopped(top_m_s, braking_m_s2, horizon_s + reacts_s)
        self._reach_m = 0.5 * top_m_s**2 / braking_m_s2
        self.turns_back_s = 2.0 * top_m_s / braking_m_s2
        self.slow_m_s = 0.0 if self._stops_in_sight else braking_m_s2 * horizon_s

    def speed_m_s(self, roadmap: Roadmap, pose: Pose2, time: FloatArray, then: int, known: Field) -> float:
        """Of its way down a field, and on to vertex ``then`` unless that is -1; by its map's distances."""
        if self._stops_in_sight:
            return self._top_m_s
        way = roadmap.way(pose.x_m, pose.y_m, time, self._reach_m)
        left_m = self._reach_m - STEP_M * len(way)
        if then >= 0 and len(way) and left_m > 0.0:
            x, y = way[-1, :2].tolist()
            way = np.concatenate([way, roadmap.way(x, y, roadmap.time_s(then), left_m)[1:]])
        limits = self._top_m_s, self._braking_m_s2, self._reacts_s
        return float(speed_to_stop(way, known, self._keep_m, *limits))
