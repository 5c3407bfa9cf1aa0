"""A footprint as the kernels take it: checked, counter-clockwise, with the discs that bound it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.arrays import read_only
from pilotage.kernels.control.footprint import Body, polygon_distance

ROUND = 0.95
"""With an inner radius of this share of the outer one or more a body is taken for a disc."""


def make_body(footprint_xy_m: FloatArray) -> Body:
    """Check a convex footprint (K, 2) around the base's origin and bound it.

    Raises
    ------
    InputError
        Where it is no convex polygon or does not hold the origin.
    """
    polygon = read_only(footprint_xy_m)
    if polygon.ndim != 2 or polygon.shape[1] != 2 or polygon.shape[0] < 3:
        raise InputError(f"footprint: expected three corners x, y or more, found shape {polygon.shape}")
    if not np.all(np.isfinite(polygon)):
        raise InputError("footprint: expected finite corners")
    edges = np.roll(polygon, -1, axis=0) - polygon
    turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
    if np.all(turns < 0.0):
        polygon = read_only(polygon[::-1])
    elif not np.all(turns > 0.0):
        raise InputError("footprint: expected a convex polygon, its corners in order; take its convex hull")
    inner = -float(polygon_distance(0.0, 0.0, polygon))
    if inner <= 0.0:
        raise InputError("footprint: expected the base's origin inside; shift the corners or the base")
    outer = float(np.hypot(polygon[:, 0], polygon[:, 1]).max())
    # Discs over pieces stick out of a round body by up to 0.12 m, and turn: one stays where it stands.
    round_one = np.array([[0.0, 0.0, outer]])
    return Body(polygon, inner, outer, round_one if inner > ROUND * outer else _covering_discs(polygon))


def _covering_discs(polygon: FloatArray) -> FloatArray:
    """Discs (D, 3) over the pieces of the polygon, cut in three along its longer side and in two across."""
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    axis = int(np.argmax(high - low))
    discs = []
    for k in range(3):
        edges = low[axis] + (high[axis] - low[axis]) * np.array([k, k + 1]) / 3.0
        slab = _clipped(_clipped(polygon, axis, edges[0], 1.0), axis, edges[1], -1.0)
        other = 1 - axis
        middle = 0.5 * float(slab[:, other].min() + slab[:, other].max())
        for sign in (-1.0, 1.0):
            corners = _clipped(slab, other, middle, sign)
            centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
            radius = float(np.hypot(*(corners - centre).T).max())
            discs.append([centre[0], centre[1], radius])
    return np.array(discs)


def _clipped(polygon: FloatArray, axis: int, at: float, sign: float) -> FloatArray:
    """The part of a convex polygon on one side of a line across an axis (Sutherland and Hodgman 1974)."""
    out = []
    for k in range(polygon.shape[0]):
        a, b = polygon[k], polygon[(k + 1) % polygon.shape[0]]
        inside_a, inside_b = sign * (a[axis] - at) >= 0.0, sign * (b[axis] - at) >= 0.0
        if inside_a:
            out.append(a)
        if inside_a != inside_b:
            out.append(a + (b - a) * (at - a[axis]) / (b[axis] - a[axis]))
    return np.array(out)


def dense_m(inner_m: float, beam_step_rad: float) -> float:
    """How far ahead of the laser nothing as wide as the body, 2 ``inner_m``, fits between two beams.

    That is between one straight ahead and the next one, across the way: 2 ``inner_m`` / tan(step).
    From a right angle on, and of a single beam, nowhere.
    """
    return 2.0 * inner_m / math.tan(beam_step_rad) if 0.0 < beam_step_rad < 0.5 * math.pi - 1e-9 else 0.0
