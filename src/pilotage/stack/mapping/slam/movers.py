"""Who walks about: what stands where the last keyframes looked through is no part of the building."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.frames import composed
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

    Attributes
    ----------
    crowded
        Of how many scans so much seemed to move that they were left whole.
    """

    def __init__(self) -> None:
        self._views: list[tuple[FloatArray, FloatArray]] = []
        self._asked: tuple[FloatArray, IntArray, FloatArray] | None = None
        self.crowded = 0

    def without(self, cloud: FloatArray, pose: FloatArray) -> FloatArray:
        """Return a scan (K, 6) at about a pose (3,) without the points that have come there."""
        if self._asked is None:
            return cloud
        moving = seen_through(cloud, pose, *self._asked, VOTES, MARGIN_M, BESIDE_M, FARTHEST_M)
        count = int(np.count_nonzero(moving))
        if count >= MOST * cloud.shape[0]:
            self.crowded += bool(count)
            return cloud
        return cloud[~moving] if count else cloud

    def add(self, cloud: FloatArray, pose: FloatArray) -> None:
        """Take in a keyframe (K, 6), all of it, at a pose (3,)."""
        self._views = [*self._views, (polar(cloud), pose)][-VIEWS:]
        self._ask()

    def carry(self, moved: FloatArray) -> None:
        """Move the views by a motion (3,) of the map."""
        self._views = [(view, np.asarray(composed(moved, at))) for view, at in self._views]
        self._ask()

    def forget(self) -> None:
        """Begin anew."""
        self._views, self._asked = [], None

    def _ask(self) -> None:
        """Choose the views that are asked, the newest first."""
        chosen = self._views[::-EVERY]
        if len(chosen) < VOTES:
            self._asked = None
            return
        counts = np.array([view.shape[0] - 1 for view, _ in chosen])
        views = np.zeros((len(chosen), int(counts.max()) + 1, 2))
        for row, (view, _) in zip(views, chosen, strict=True):
            row[: view.shape[0]] = view
        self._asked = views, counts, np.array([at for _, at in chosen])
