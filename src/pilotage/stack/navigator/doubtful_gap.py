"""Gaps on a plan: how much they spare, and which may prove closed by sides that nobody has seen yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.gaps import gap_widths
from pilotage.maps.distance_field import DistanceField

BEFORE_M = 0.05
"""A plan needs so much more room to begin than what may be there leaves it."""


@dataclass(frozen=True, slots=True)
class DoubtfulGap:
    """The first such gap on a path, or several close together.

    Attributes
    ----------
    before
        Index of the path's last state that is out of reach of whatever may be hidden there.
    before_m
        How far along the path that is.
    closed
        How likely it is closed.
    """

    before: int
    before_m: float
    closed: float


def doubtful_gap(
    path_xy_m: FloatArray, mapped_m: FloatArray, known: DistanceField, radius_m: float, hidden_m: float
) -> DoubtfulGap | None:
    """The gap beside mapped discs (M, 3) that a disc may prove too wide for on a path (N, 2), if any.

    What is hidden reaches into a gap by anything from nothing to ``hidden_m``, each as likely: a gap with
    s metres to spare is closed with probability 1 - s / ``hidden_m``. None as well where the path begins too
    near to it to turn back before it.

    Parameters
    ----------
    known
        Distance to what was on the map before.
    radius_m
        Of the disc that is to pass.
    """
    points = np.ascontiguousarray(path_xy_m)
    clear_m = radius_m + hidden_m + BEFORE_M
    away_m, width_m = _gaps(points, mapped_m, known, max(2.0 * radius_m + hidden_m, clear_m))
    spare_m = width_m - 2.0 * radius_m
    doubtful = np.flatnonzero(spare_m < hidden_m)
    if not len(doubtful):
        return None
    before = np.flatnonzero(away_m[: doubtful[0]] > clear_m)
    if not len(before):
        return None
    index = int(before[-1])
    before_m = float(np.hypot(*np.diff(points[: index + 1], axis=0).T).sum())
    return DoubtfulGap(index, before_m, float(min(1.0 - spare_m[doubtful].min() / hidden_m, 1.0)))


def is_tight(
    path_xy_m: FloatArray, mapped_m: FloatArray, known: DistanceField, radius_m: float, tight_m: float
) -> bool:
    """Whether a disc on a path (N, 2) has less than ``tight_m`` to spare beside mapped discs (M, 3)."""
    enough_m = 2.0 * radius_m + tight_m
    _, width_m = _gaps(np.ascontiguousarray(path_xy_m), mapped_m, known, enough_m)
    return bool((width_m < enough_m).any())


def _gaps(
    points: FloatArray, mapped_m: FloatArray, known: DistanceField, enough_m: float
) -> tuple[FloatArray, FloatArray]:
    """Distance (N,) of points (N, 2) to the mapped discs, and width (N,) of the gaps they stand in."""
    walls = np.column_stack([known.at(points), *(_slope(known, points, axis) for axis in (0, 1))])
    away_m, width_m = gap_widths(points, mapped_m, walls, enough_m)
    return away_m, width_m


def _slope(known: DistanceField, points: FloatArray, axis: int) -> FloatArray:
    """(N,) by how much the distance grows along an axis."""
    step = np.zeros(2)
    step[axis] = known.resolution_m
    return np.asarray(known.at(points + step) - known.at(points - step))
