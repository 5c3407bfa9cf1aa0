"""The nodes that times to go are worked out on: where the body fits, how slow it is, what room there is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray
from pilotage.maps.distance_field import DistanceField

EASY_M, TIGHT_FACTOR = 0.5, 1.0
"""Nearer to walls than this, beyond the body, a metre takes longer: twice as long where it just fits."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What nodes are laid over.

    Attributes
    ----------
    field
        Distances to what is on the map.
    bounds_m
        Of the map.
    clearance_m
        What the body's middle keeps from that.
    speed_m_s
        Where there is room.
    lane_m
        Who keeps to one side is so far from where a passage is widest.
    """

    field: DistanceField
    bounds_m: tuple[float, float, float, float]
    clearance_m: float
    speed_m_s: float
    lane_m: float

    def nodes(self, spacing_m: float) -> tuple[FloatArray, FloatArray]:
        """(rows, columns) seconds a metre, infinite where the body does not fit, and half the width there.

        Row 0 has the lowest y.
        """
        xmin, ymin, xmax, ymax = self.bounds_m
        xs = np.arange(xmin, xmax + 0.5 * spacing_m, spacing_m)
        ys = np.arange(ymin, ymax + 0.5 * spacing_m, spacing_m)
        grid = np.stack(np.meshgrid(xs, ys), axis=-1)
        distance = self.field.at(grid.reshape(-1, 2)).reshape(grid.shape[:2])
        free = distance >= self.clearance_m
        tight = np.clip(1.0 - (distance - self.clearance_m) / EASY_M, 0.0, 1.0)
        slowness = np.where(free, (1.0 + TIGHT_FACTOR * tight**2) / self.speed_m_s, np.inf)
        size = 2 * math.ceil(self.lane_m / spacing_m) + 1
        return slowness, scipy.ndimage.maximum_filter(distance, size=size)
