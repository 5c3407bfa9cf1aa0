"""What a guard is for: somebody who is neither on the map nor a team mate."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.scans.loose_clusters import loose_clusters
from pilotage.sensors.sensor import NonNegative, Positive


class WatchConfig(Config):
    """When returns of something strange are somebody."""

    gap_m: Positive = 0.4
    widest_m: Positive = 1.0
    points: int = Field(default=2, ge=1, le=1000)
    """So many returns at least."""
    scans: int = Field(default=5, ge=1, le=1000)
    """Seen in so many scans in a row, for each that is seen at once: the more strangers there are, the more
    likely it is that the robot is not where it believes to be, and its localizer has not noticed yet.
    """
    follows_m: Positive = 0.6
    """From one scan to the next it moves no farther."""
    mate_m: NonNegative = 0.3
    """What is this near to a mate's body, where it says it is, farther by what it may have driven since, is
    the mate.

    Of a mate that was not heard for long that is everything: a broken radio makes no false alarm, and a team
    without radios raises none.
    """


class IntruderWatch:
    """Follows strange clusters from scan to scan."""

    def __init__(self, config: WatchConfig) -> None:
        self._config = config
        self._tracks: list[tuple[float, float, int, bool]] = []
        """Where each is, in how many scans it was seen, and whether that was told."""

    def step(self, strange_xy_m: FloatArray) -> list[tuple[float, float]]:
        """Take in a scan's returns (M, 2), map frame, of what is on no map and no mate.

        Returns
        -------
        Where somebody now is for sure who was not before.
        """
        config = self._config
        found: list[tuple[float, float]] = []
        tracks: list[tuple[float, float, int, bool]] = []
        if not len(strange_xy_m):  # as nearly always
            self._tracks = tracks
            return found
        clusters = loose_clusters(strange_xy_m, config.gap_m, config.widest_m, config.points)
        for x, y in clusters.tolist():
            before = [t for t in self._tracks if math.hypot(x - t[0], y - t[1]) <= config.follows_m]
            count = max((seen for _, _, seen, _ in before), default=0) + 1
            told = any(was_told for _, _, _, was_told in before)
            if not told and count >= config.scans * len(clusters):
                found.append((x, y))
                told = True
            tracks.append((x, y, count, told))
        self._tracks = tracks
        return found

    def follows(self, strange_xy_m: FloatArray, reach_m: float) -> BoolArray:
        """(M,) which of a scan's returns, map frame, are of who was told and never out of sight since.

        He is no mate, however old the words of mates have become meanwhile.

        Parameters
        ----------
        reach_m
            How far somebody may have gone since the last scan.
        """
        config, follows = self._config, np.zeros(len(strange_xy_m), dtype=np.bool_)
        told = [(x, y) for x, y, _, was_told in self._tracks if was_told]
        if not told:  # as nearly always
            return follows
        clusters = loose_clusters(strange_xy_m, config.gap_m, config.widest_m, config.points)
        if not len(clusters):
            return follows
        away_m = np.linalg.norm(strange_xy_m[:, None] - clusters, axis=2)
        of_cluster = np.where(away_m.min(axis=1) <= 0.5 * config.widest_m, away_m.argmin(axis=1), -1)
        for track in told:
            moved_m = np.hypot(*(clusters - track).T)
            if moved_m.min() <= reach_m:
                follows |= of_cluster == moved_m.argmin()
        return follows
