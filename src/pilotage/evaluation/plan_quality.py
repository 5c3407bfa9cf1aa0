"""How good a planned path is: smoothness of its own states, and its clearance checked every centimetre."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.bodies.outline import least_along
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint

CHECK_M = 0.01


def smoothness(points_xy_m: FloatArray) -> float:
    """Sum over the inner points of (2 (pi - angle) / (a + b))^2; 0 for a straight line.

    ``angle`` lies between the segments of lengths a and b that meet at a point (the night-watch report's
    third metric). Points that coincide with the one before are left out.
    """
    moved = np.ones(len(points_xy_m), dtype=np.bool_)
    moved[1:] = np.hypot(*np.diff(points_xy_m, axis=0).T) > 0.0
    points = points_xy_m[moved]
    if len(points) < 3:
        return 0.0
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(directions) + math.pi) % (2.0 * math.pi) - math.pi)  # pi - angle
    return float(np.sum((2.0 * turns / (lengths[:-1] + lengths[1:])) ** 2))


def clearance_m(states: FloatArray, walls: SegmentMap, body: Footprint) -> float:
    """Least distance of the body's edge from the walls along a path, looked at every centimetre.

    Between two states (x, y, theta) the heading turns evenly.
    """
    lengths = np.hypot(*np.diff(states[:, :2], axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(2, math.ceil(float(s[-1]) / CHECK_M) + 1)
    at = np.linspace(0.0, float(s[-1]), count)
    columns = states[:, 0], states[:, 1], np.unwrap(states[:, 2])
    fine = np.column_stack([np.interp(at, s, column) for column in columns])
    both = np.ascontiguousarray(np.vstack([fine, states[:, :3]]))
    return float(least_along(both, body.points_m, body.radius_m, walls.segments_m, walls.circles_m))
