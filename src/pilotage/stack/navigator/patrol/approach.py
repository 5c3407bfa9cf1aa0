"""How fast a robot on weak brakes comes to a door that it turns into."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.control import bends
from pilotage.stack.patrol.roadmap import STEP_M, Roadmap

BEND_RAD = 0.4
"""A path that is turned by more from where the robot heads leads around a bend."""


class Approach:
    """The speed from which it slows down in time for a bend in a narrow place.

    Arcs of the dynamic window are looked at no farther than its horizon: who takes longer to stop came to
    each door beside its path too fast, and past it. Where it is wide, or straight on, that costs less than
    braking.

    Parameters
    ----------
    top_m_s, braking_m_s2
        By the data sheet.
    sees_s
        How long it drives from one look to the end of its arcs. Who stops within as far need do nothing.
    narrow_m
        Half the width of a passage that is narrow.

    Attributes
    ----------
    turns_back_s
        So long it takes to come to rest from its top speed, and back up to it.
    """

    def __init__(self, top_m_s: float, braking_m_s2: float, sees_s: float, narrow_m: float) -> None:
        self._top_m_s, self._braking_m_s2, self._narrow_m = top_m_s, braking_m_s2, narrow_m
        self._bend_m_s = 2.0 * braking_m_s2 * sees_s
        self._reach_m = (top_m_s**2 - self._bend_m_s**2) / (2.0 * braking_m_s2)
        self.turns_back_s = 2.0 * top_m_s / braking_m_s2

    def speed_m_s(self, roadmap: Roadmap, pose: Pose2, time: FloatArray, then: int) -> float:
        """Of its way down a field, and on to vertex ``then`` unless that is -1."""
        if self._reach_m <= 0.0:
            return self._top_m_s
        way = roadmap.way(pose.x_m, pose.y_m, time, self._reach_m)
        left_m = self._reach_m - STEP_M * len(way)
        if then >= 0 and len(way) and left_m > 0.0:
            x, y = way[-1, :2].tolist()
            way = np.concatenate([way, roadmap.way(x, y, roadmap.time_s(then), left_m)[1:]])
        bend_m = bends.narrow_bend_m(way, pose.theta_rad, BEND_RAD, self._narrow_m)
        return min(self._top_m_s, math.sqrt(self._bend_m_s**2 + 2.0 * self._braking_m_s2 * bend_m))
