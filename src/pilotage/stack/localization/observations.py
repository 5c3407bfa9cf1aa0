"""What a run's sensors saw, kept to its end: rows that grow, each tied to a keyframe."""

from __future__ import annotations

import numpy as np

from pilotage.core.rows import doubled
from pilotage.core.types import FloatArray, IntArray


class Observations:
    """Observations of one kind.

    Attributes
    ----------
    frame
        (M,) keyframe that each was made from.
    values
        (M, width) what was seen, in the keyframe's frame (see ``kernels.sheet_graph``).
    spread
        (M,) its standard deviation, metres.
    pose_std
        (M,) how well the position was known when it was made.
    points
        (M, 4) where it lies on the map and the beam's direction, as last worked out.
    landmark
        (M,) which line it belongs to, -1 for none.
    count
        How many rows are in use.
    """

    def __init__(self, width: int, room: int = 4096) -> None:
        self.frame: IntArray = np.zeros(room, np.int64)
        self.values: FloatArray = np.zeros((room, width))
        self.spread: FloatArray = np.ones(room)
        self.pose_std: FloatArray = np.zeros(room)
        self.points: FloatArray = np.zeros((room, 4))
        self.landmark: IntArray = np.full(room, -1, np.int64)
        self.count = 0

    def add(self, frame: int, values: tuple[float, ...], spread: float, pose_std: float) -> None:
        """Add one."""
        k = self.count
        if k == self.frame.shape[0]:
            self.frame, self.landmark = doubled(self.frame), doubled(self.landmark)
            self.values, self.points = doubled(self.values), doubled(self.points)
            self.spread, self.pose_std = doubled(self.spread), doubled(self.pose_std)
        self.frame[k], self.values[k] = frame, values
        self.spread[k], self.pose_std[k] = spread, pose_std
        self.landmark[k] = -1
        self.count = k + 1

    @property
    def seen(self) -> FloatArray:
        """(count, 4) the points in use."""
        return self.points[: self.count]

    @property
    def owner(self) -> IntArray:
        """(count,) the landmarks in use; a view, so that it can be written to."""
        return self.landmark[: self.count]
