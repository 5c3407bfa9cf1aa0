"""Mates that no laser shows, by what they tell: how far they have to go to whoever brakes for them."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control import eikonal
from pilotage.stack.navigator.patrol.senses import NO_POINTS, Senses
from pilotage.stack.patrol.roadmap import Roadmap

APART = 0.55
"""Nodes so far from a wall, in steps between nodes, have no neighbour behind it, however thin it is."""
LONGER = 2.0
"""By so many steps, about, ways around an edge come out longer than they are, as nodes lie beside it."""


class HiddenMates:
    """Says where mates that talk may come from, as if walls were not in between.

    Two that stop within their own half of the distance between them do not touch, if both see each other. Who
    takes long to stop is too fast for what it sees where somebody comes out of a door beside its way; but it
    knows by radio that he is there. Then the distance between both is the shortest way over the floor, less
    what he may have driven since he said where he is.

    Parameters
    ----------
    roadmap
        Of all floor, whoever stands on it.
    """

    def __init__(self, senses: Senses, roadmap: Roadmap) -> None:
        self._senses, self._roadmap = senses, roadmap
        # As near to walls as may be: who meet around an edge are nearer than along what either may drive.
        floor = np.isfinite(roadmap.slowness_for(APART * roadmap.spacing_m))
        self._metres = np.where(floor, 1.0, np.inf)

    def fronts(self, stop_m: float) -> FloatArray:
        """(H, 2) where the front of each is, base frame: as far as it has to go, in the direction that leads
        to it from here; of those that are to be heeded by who needs so much to stop."""
        senses = self._senses
        pose, own, found = senses.pose, senses.task.robot, []
        strange = senses.strange_on_map()
        for number, (x, y, within_m, radius_m) in enumerate(senses.mates_by_their_words(senses.t_s).tolist()):
            taken_m = within_m + radius_m
            reach_m = 2.0 * stop_m + senses.radius_m + senses.config.gap_m + taken_m
            if number == own or not math.hypot(x - pose.x_m, y - pose.y_m) < reach_m:
                continue
            if len(strange) and np.hypot(*(strange - (x, y)).T).min() < taken_m:
                continue
            away_m, dx, dy = self._way_to(x, y, reach_m)
            if away_m < reach_m:
                found.append((max(away_m - taken_m, 0.1), math.atan2(dy, dx) - pose.theta_rad))
        if not found:
            return NO_POINTS
        away, bearing = np.array(found).T
        return np.column_stack([away * np.cos(bearing), away * np.sin(bearing)])

    def _way_to(self, x: float, y: float, reach_m: float) -> tuple[float, float, float]:
        """How far a place is over the floor, and the direction that leads to it; infinite beyond reach."""
        roadmap, pose = self._roadmap, self._senses.pose
        (x0, y0), step_m = roadmap.origin_xy_m, roadmap.spacing_m
        (row, column), (to_row, to_column) = roadmap.node(pose.x_m, pose.y_m), roadmap.node(x, y)
        half = math.ceil(reach_m / step_m)
        top, left = max(0, row - half), max(0, column - half)
        metres = self._metres[top : row + half + 1, left : column + half + 1]
        time = np.full(metres.shape, np.inf)
        near = (
            slice(max(0, to_row - top - 1), max(0, to_row - top + 2)),
            slice(max(0, to_column - left - 1), max(0, to_column - left + 2)),
        )
        time[near][np.isfinite(metres[near])] = 0.0
        eikonal.sweep_down(time, metres, step_m)
        field = time, x0 + left * step_m, y0 + top * step_m, step_m
        away_m = eikonal.value_at(pose.x_m, pose.y_m, field, 0.0) - LONGER * step_m
        return away_m, *eikonal.descent(pose.x_m, pose.y_m, field)
