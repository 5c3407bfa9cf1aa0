"""The ground along a path: heights, how steep it climbs, and how steep the ground is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.maps.elevation import ElevationModel


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Profile of a path, at even steps of about a cell.

    Attributes
    ----------
    s_m
        (N,) length along the path.
    elevation_m
        (N,) height there; NaN where unknown.
    grade_rad
        (N - 1,) rise of each step along the path, negative downhill.
    """

    s_m: FloatArray
    elevation_m: FloatArray
    grade_rad: FloatArray

    @property
    def climb_m(self) -> float:
        """Sum of all that goes up."""
        rise = np.diff(self.elevation_m)
        return float(rise[rise > 0.0].sum())

    @property
    def descent_m(self) -> float:
        """Sum of all that goes down."""
        rise = np.diff(self.elevation_m)
        return float(-rise[rise < 0.0].sum())

    @property
    def steepest_rad(self) -> float:
        """Greatest grade up or down; NaN where all is unknown."""
        known = self.grade_rad[np.isfinite(self.grade_rad)]
        return float(np.abs(known).max()) if len(known) else math.nan


def relief(ground: ElevationModel, path_xy_m: FloatArray, step_m: float | None = None) -> Relief:
    """Profile of the polyline (N, 2) on the ground.

    Parameters
    ----------
    step_m
        Length of a step, made a little shorter so that whole ones fit; None takes a cell's side.
    """
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path_xy_m, axis=0).T))])
    step = ground.resolution_m if step_m is None else step_m
    at = np.linspace(0.0, s[-1], max(1, math.ceil(s[-1] / step)) + 1)
    points = np.column_stack([np.interp(at, s, path_xy_m[:, k]) for k in (0, 1)])
    heights = ground.heights_at(points)
    with np.errstate(invalid="ignore"):
        grade = np.arctan2(np.diff(heights), np.diff(at))
    return Relief(at, heights, grade)
