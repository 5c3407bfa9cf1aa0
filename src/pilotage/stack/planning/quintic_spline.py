"""A curve of fifth degree through the points of a path (section 5 of the rover report)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

PARTS = 8
"""Into so many parts every stretch between two knots is divided to measure lengths and to unwrap headings."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveSamples:
    """A curve at equal steps of its length.

    Attributes
    ----------
    s_m
        (N,) length from the start.
    points_xy_m
        (N, 2) positions.
    heading_rad
        (N,) direction of the tangent, unwrapped: it goes on beyond pi instead of jumping.
    curvature_per_m
        (N,) signed, positive to the left.
    """

    s_m: FloatArray
    points_xy_m: FloatArray
    heading_rad: FloatArray
    curvature_per_m: FloatArray

    def times_s(self, speed_m_s: float) -> FloatArray:
        """(N,) when each sample is passed at a constant speed (equations 5.5 and 5.6).

        Raises
        ------
        InputError
            For a speed that is not above 0.
        """
        if not speed_m_s > 0.0:
            raise InputError(f"travel time: expected a speed above 0 m/s, found {speed_m_s}")
        return self.s_m / speed_m_s


class QuinticSpline:
    """Polynomials of fifth degree between knots (equation 5.3), joined with four steady derivatives.

    Passes through every knot; the parameter is the length of the polyline through them. At both ends the
    third and fourth derivatives are zero: of all curves through the knots this one has the least jerk
    (Schoenberg 1964), and its ends do not swing out as those of a plain polynomial do.

    Parameters
    ----------
    knots_xy_m
        (K, 2); knots equal to the one before are left out. On a bend it leaves the polyline by a part of
        the distance of the knots there: what has to stay near it needs close knots.

    Raises
    ------
    InputError
        Where there are not two different, finite knots.
    """

    def __init__(self, knots_xy_m: FloatArray) -> None:
        from scipy.interpolate import make_interp_spline  # 0.1 s to import, and most runs have no spline

        knots = np.asarray(knots_xy_m, dtype=np.float64).reshape(-1, 2)
        if not np.isfinite(knots).all():
            raise InputError("quintic spline: expected finite knots, found others")
        moved = np.ones(len(knots), dtype=np.bool_)
        moved[1:] = (np.diff(knots, axis=0) != 0.0).any(axis=1)
        knots = knots[moved]
        if len(knots) < 2:
            raise InputError(f"quintic spline: expected at least two different knots, found {len(knots)}")
        if len(knots) == 2:
            knots = np.insert(knots, 1, knots.mean(axis=0), axis=0)
        chords = np.hypot(*np.diff(knots, axis=0).T)
        # In mean distances of the knots, so that the equations are well scaled on any map.
        self._u: FloatArray = np.concatenate([[0.0], np.cumsum(chords / chords.mean())])
        ends: Any = [(3, np.zeros(2)), (4, np.zeros(2))]
        self._curve: Any = make_interp_spline(self._u, knots, k=5, bc_type=(ends, ends))
        self._slope: Any = self._curve.derivative(1)
        self._bend: Any = self._curve.derivative(2)
        self._fine, self._s_fine = self._lengths()
        self._heading_fine: FloatArray = np.unwrap(self._directions(self._fine))

    @property
    def length_m(self) -> float:
        """Length of the curve."""
        return float(self._s_fine[-1])

    def sampled(self, count: int) -> CurveSamples:
        """Samples at ``count`` equal steps of length, both ends included.

        Raises
        ------
        InputError
            For fewer than two samples.
        """
        if count < 2:
            raise InputError(f"quintic spline: expected at least 2 samples, found {count}")
        return self.at(np.linspace(0.0, self.length_m, count))

    def at(self, s_m: FloatArray) -> CurveSamples:
        """The curve at lengths (N,) from its start."""
        s = np.asarray(s_m, dtype=np.float64)
        u = self._parameters(s)
        slope, bend = self._slope(u), self._bend(u)
        speed = np.maximum(np.hypot(slope[:, 0], slope[:, 1]), np.finfo(float).tiny)
        curvature = (slope[:, 0] * bend[:, 1] - slope[:, 1] * bend[:, 0]) / speed**3
        return CurveSamples(s, np.asarray(self._curve(u)), self._headings(u), curvature)

    def knot_lengths_m(self) -> FloatArray:
        """(K,) length from the start to every knot, of those that were kept."""
        return self._s_fine[::PARTS]

    def _lengths(self) -> tuple[FloatArray, FloatArray]:
        """Parameters that divide every stretch in parts, and the curve's length up to each (Gauss)."""
        parts = np.arange(PARTS) / PARTS
        fine = np.append((self._u[:-1, None] + np.diff(self._u)[:, None] * parts).ravel(), self._u[-1])
        at, weights = np.polynomial.legendre.leggauss(5)
        half = 0.5 * np.diff(fine)
        inner = self._slope(fine[:-1, None] + half[:, None] * (1.0 + at))
        lengths = half * (np.hypot(inner[..., 0], inner[..., 1]) @ weights)
        return fine, np.concatenate([[0.0], np.cumsum(lengths)])

    def _parameters(self, s: FloatArray) -> FloatArray:
        """Parameters at lengths: interpolated, then two steps by Newton within the part."""
        part = np.clip(np.searchsorted(self._s_fine, s, side="right") - 1, 0, len(self._fine) - 2)
        low, high = self._fine[part], self._fine[part + 1]
        s_low, s_high = self._s_fine[part], self._s_fine[part + 1]
        u = low + (high - low) * np.clip((s - s_low) / np.maximum(s_high - s_low, 1e-300), 0.0, 1.0)
        at, weights = np.polynomial.legendre.leggauss(5)
        for _ in range(2):
            half = 0.5 * (u - low)
            inner = self._slope(low[:, None] + half[:, None] * (1.0 + at))
            too_far = s_low + half * (np.hypot(inner[..., 0], inner[..., 1]) @ weights) - s
            speed = np.hypot(*self._slope(u).T)
            u = np.clip(u - too_far / np.maximum(speed, 1e-12), low, high)
        return np.asarray(u)

    def _directions(self, u: FloatArray) -> FloatArray:
        slope = self._slope(u)
        return np.asarray(np.arctan2(slope[:, 1], slope[:, 0]))

    def _headings(self, u: FloatArray) -> FloatArray:
        """Directions on the turn that the finely unwrapped ones are on."""
        direction = self._directions(u)
        near = np.interp(u, self._fine, self._heading_fine)
        turns = np.round((near - direction) / (2.0 * math.pi))
        return np.asarray(direction + 2.0 * math.pi * turns)
