"""Who walks about: what stands where the last keyframes looked through is no part of the building."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.movers import polar, seen_through

MARGIN_M, BESIDE_M, FARTHEST_M = 0.3, 0.2, 8.0
"""How far beams must have gone on behind a point, how wide around it, and how far away it may be."""
VIEWS, EVERY, VOTES = 15, 3, 2
"""Of the last keyframes every third is asked, and so many must have looked through a point."""
MOST = 0.4
"""Share of a scan that may be movers: where more seems to move, the guess is wrong and not the world."""


class Movers:
    """The last keyframes' views, to which people are told from walls.

    Somebody who walks beside the robot looks to an alignment as if the robot stood: in a bare corridor, where
    the walls leave it open how far one went, three companions stop the map.
    """

    def __init__(self) -> None:
        self._views: list[tuple[FloatArray, FloatArray]] = []

    def without(self, cloud: FloatArray, pose: FloatArray) -> FloatArray:
        """Return a scan (K, 6) at about a pose (3,) without the points that have come there."""
        votes = np.zeros(cloud.shape[0], np.int64)
        for view, at in self._views[::-EVERY]:
            votes += seen_through(cloud, between(at, pose), view, MARGIN_M, BESIDE_M, FARTHEST_M)
        moving = votes >= VOTES
        count = int(np.count_nonzero(moving))
        return cloud[~moving] if 0 < count < MOST * cloud.shape[0] else cloud

    def add(self, cloud: FloatArray, pose: FloatArray) -> None:
        """Take in a keyframe (K, 6), all of it, at a pose (3,)."""
        self._views = [*self._views, (polar(cloud), pose)][-VIEWS:]

    def carry(self, moved: FloatArray) -> None:
        """Move the views by a motion (3,) of the map."""
        self._views = [(view, np.asarray(composed(moved, at))) for view, at in self._views]

    def forget(self) -> None:
        """Begin anew."""
        self._views = []
