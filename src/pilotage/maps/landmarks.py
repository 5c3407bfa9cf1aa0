"""Point landmarks with identities, as beacons report them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.filters.sighting import Known


@dataclass(frozen=True, slots=True)
class Landmarks:
    """Known points: ids (M,) unique integers, points_xy_m (M, 2) in the map frame."""

    ids: IntArray
    points_xy_m: FloatArray

    def __post_init__(self) -> None:
        ids = np.ascontiguousarray(self.ids, dtype=np.int64).reshape(-1)
        points = np.ascontiguousarray(self.points_xy_m, dtype=np.float64).reshape(-1, 2)
        if ids.shape[0] != points.shape[0]:
            raise InputError(
                f"landmarks: expected one id a point, found {ids.shape[0]} and {points.shape[0]}"
            )
        if np.unique(ids).shape[0] != ids.shape[0]:
            raise InputError("landmarks: expected every id once, found one twice")
        if not (np.abs(points) <= FARTHEST_M).all():
            raise InputError(
                f"landmarks: expected coordinates within {FARTHEST_M:g} m, found others, NaN or infinity"
            )
        ids.flags.writeable = False
        points.flags.writeable = False
        object.__setattr__(self, "ids", ids)
        object.__setattr__(self, "points_xy_m", points)

    def __len__(self) -> int:
        return int(self.ids.shape[0])

    def by_id(self) -> Known:
        """In the order of their ids, as filters look them up."""
        order = np.argsort(self.ids)
        return Known(self.ids[order], self.points_xy_m[order])
