"""A map of straight walls and discs: the geometry that scans, collisions and planners share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.geometry import plane


@dataclass(frozen=True, slots=True)
class SegmentMap:
    """Infinitely thin wall segments and solid discs inside a rectangle.

    Attributes
    ----------
    segments_m
        (N, 4) x0, y0, x1, y1.
    circles_m
        (M, 3) x, y, radius.
    bounds_m
        xmin, ymin, xmax, ymax of the floor.
    """

    segments_m: FloatArray
    circles_m: FloatArray
    bounds_m: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        segments = np.ascontiguousarray(self.segments_m, dtype=np.float64).reshape(-1, 4)
        circles = np.ascontiguousarray(self.circles_m, dtype=np.float64).reshape(-1, 3)
        if not ((np.abs(segments) <= FARTHEST_M).all() and (np.abs(circles) <= FARTHEST_M).all()):
            raise InputError(
                f"map: expected coordinates within {FARTHEST_M:g} m, found others, NaN or infinity; "
                "mend the map file"
            )
        if (circles[:, 2] <= 0.0).any():
            raise InputError("map: expected circles of positive radius, found one that is not")
        xmin, ymin, xmax, ymax = self.bounds_m
        if not (xmin < xmax and ymin < ymax):
            raise InputError(f"map: expected bounds xmin < xmax and ymin < ymax, found {self.bounds_m}")
        segments.flags.writeable = False
        circles.flags.writeable = False
        object.__setattr__(self, "segments_m", segments)
        object.__setattr__(self, "circles_m", circles)

    @staticmethod
    def of(segments_m: FloatArray, circles_m: FloatArray | None = None) -> SegmentMap:
        """Build a map whose bounds are those of its geometry."""
        segments = np.asarray(segments_m, dtype=np.float64).reshape(-1, 4)
        circles = np.zeros((0, 3)) if circles_m is None else np.asarray(circles_m, float).reshape(-1, 3)
        corners = [segments[:, :2], segments[:, 2:]]
        corners += [circles[:, :2] - circles[:, 2:], circles[:, :2] + circles[:, 2:]]
        points = np.concatenate(corners)
        if points.shape[0] == 0:
            raise InputError("map: expected at least one wall or circle, found none")
        low, high = points.min(axis=0), points.max(axis=0)
        return SegmentMap(segments, circles, (float(low[0]), float(low[1]), float(high[0]), float(high[1])))

    def with_obstacles(self, segments_m: FloatArray, circles_m: FloatArray) -> SegmentMap:
        """Return a new map with more segments and circles and the same bounds."""
        return SegmentMap(
            np.concatenate([self.segments_m, np.asarray(segments_m, float).reshape(-1, 4)]),
            np.concatenate([self.circles_m, np.asarray(circles_m, float).reshape(-1, 3)]),
            self.bounds_m,
        )

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Exact distance from a point to the nearest wall or disc edge (negative inside a disc)."""
        return float(plane.distance_to_nearest(x_m, y_m, self.segments_m, self.circles_m))

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies within the bounds."""
        xmin, ymin, xmax, ymax = self.bounds_m
        return xmin <= x_m <= xmax and ymin <= y_m <= ymax


def box_segments(x_m: float, y_m: float, length_m: float, width_m: float, theta_rad: float) -> FloatArray:
    """Return the (4, 4) sides of a box centred at x, y, its length along theta."""
    half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * np.array([length_m / 2, width_m / 2])
    corners = Pose2(x_m, y_m, theta_rad).placed(half)
    return np.hstack([corners, np.roll(corners, -1, axis=0)])
