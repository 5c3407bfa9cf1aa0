"""The outline of a robot on the floor: a disc or a simple polygon, in the base frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

NO_CORNERS: FloatArray = np.zeros((0, 2))
NO_CORNERS.flags.writeable = False  # as a polygon's: kernels are compiled once for both


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """A robot's outline; the axle's middle is the origin, x forward, y left.

    Attributes
    ----------
    points_m
        (K, 2) corners of a polygon, counter-clockwise; (0, 2) for a disc.
    radius_m
        Of the disc around the axle that holds the whole outline: a disc's own radius.
    inner_radius_m
        Of the largest disc around the axle that lies inside.
    """

    points_m: FloatArray
    radius_m: float
    inner_radius_m: float

    @property
    def is_disc(self) -> bool:
        """Whether the outline is the disc itself."""
        return len(self.points_m) == 0

    @property
    def outline(self) -> tuple[FloatArray, float, float]:
        """As the kernels take it (``kernels.geometry.solids.Outline``)."""
        return self.points_m, self.radius_m, self.inner_radius_m

    @staticmethod
    def disc(radius_m: float) -> Footprint:
        """A disc around the axle's middle."""
        return Footprint(NO_CORNERS, radius_m, radius_m)

    @staticmethod
    def polygon(points_m: FloatArray, where: str = "robot.footprint.points_m") -> Footprint:
        """A simple polygon that encloses its axle.

        Raises
        ------
        InputError
            If it has fewer than three corners or all on one line, crosses itself, or does not enclose the
            origin.
        """
        points = np.ascontiguousarray(points_m, dtype=np.float64).reshape(-1, 2)
        if points.shape[0] < 3:
            raise InputError(f"{where}: expected at least three corners, found {points.shape[0]}")
        following = np.roll(points, -1, axis=0)
        if (np.hypot(*(following - points).T) < 1e-9).any():
            raise InputError(f"{where}: expected neighbouring corners apart, found the same point twice")
        if _on_one_line(points):
            raise InputError(f"{where}: expected corners around an area, found all of them on one line")
        if _crosses_itself(points, following):
            raise InputError(f"{where}: expected a simple polygon, found sides that cross each other")
        area = 0.5 * float(np.sum(points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1]))
        if area < 0.0:
            points = np.ascontiguousarray(points[::-1])
            following = np.roll(points, -1, axis=0)
        if not _encloses_origin(points, following):
            raise InputError(
                f"{where}: expected a polygon that encloses its axle (0, 0), found one that does not"
            )
        edge = following - points
        along = np.clip(-np.sum(points * edge, axis=1) / np.sum(edge * edge, axis=1), 0.0, 1.0)
        inner = float(np.hypot(*(points + along[:, None] * edge).T).min())
        points.flags.writeable = False
        return Footprint(points, float(np.hypot(*points.T).max()), inner)


def _on_one_line(points: FloatArray) -> bool:
    """Whether no corner lies off the line through the others, to within rounding."""
    off = points - points.mean(axis=0)
    singular = np.linalg.svd(off, compute_uv=False)
    return bool(singular[1] <= 1e-12 * singular[0])


def _encloses_origin(points: FloatArray, following: FloatArray) -> bool:
    """Whether the winding number around the origin is one; a side through it does not enclose."""
    cross = points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]
    dot = np.sum(points * following, axis=1)
    through = np.abs(cross) < 1e-12
    if bool(np.any(dot[through] <= 0.0)):
        return False
    return bool(abs(np.sum(np.arctan2(cross, dot))) > math.pi)


def _crosses_itself(points: FloatArray, following: FloatArray) -> bool:
    """Whether two sides that are no neighbours meet, or neighbours fold back on each other."""

    def side(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
        return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

    def on(a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
        return bool(np.all(np.minimum(a, b) <= c)) and bool(np.all(c <= np.maximum(a, b)))

    count = points.shape[0]
    for i in range(count):
        a, b = points[i], following[i]
        back = following[(i + 1) % count]
        if side(a, b, back) == 0.0 and float(np.dot(b - a, back - b)) < 0.0:
            return True
        for j in range(i + 1, count):
            if j == (i + 1) % count or i == (j + 1) % count:
                continue
            c, d = points[j], following[j]
            s1, s2, s3, s4 = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
            if s1 * s2 < 0.0 and s3 * s4 < 0.0:
                return True
            if (s1 == 0.0 and on(a, b, c)) or (s2 == 0.0 and on(a, b, d)):
                return True
            if (s3 == 0.0 and on(c, d, a)) or (s4 == 0.0 and on(c, d, b)):
                return True
    return False
