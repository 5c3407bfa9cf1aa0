"""What a leg between two stops is, told by the odometer and the yaw at both ends alone.

Between two stops nothing is recorded: the rover turned, went around rocks, slipped, and turned again to where
it wanted to look. So a leg of odometer o is not o along its yaw. Over the chord d (a complex number, x + iy)
and the headings h0, h1 at its ends (complex, of length one) the model is

    d = o h1 (a + b h0 / h1 + e),

``a``, ``b`` complex, ``e`` an error with a (2, 2) covariance: one set of these for each class of legs, by how
much the heading differs between the ends and how long the odometer ran.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pilotage.core.types import FloatArray, IntArray

ComplexArray = npt.NDArray[np.complex128]

TURNS_RAD = (0.15, 0.5, 1.2)
"""Between these the heading's change over a leg falls into classes."""
LENGTHS_M = (10.0, 40.0)
CLASSES = (len(TURNS_RAD) + 1) * (len(LENGTHS_M) + 1)
LEAST_M = 1.0
"""A leg that the odometer missed is taken for one of this length."""
PRIOR_SHARE, PRIOR_LEGS = 0.4, 0.3
"""Weak prior of a and b for classes with next to no legs: each of this value, worth so many legs."""
PRIOR_VAR = 0.1
"""The same of an error's variance, worth two legs."""


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """M legs between stops.

    Attributes
    ----------
    chord_m
        (M,) from stop to stop, x + iy.
    before, after
        (M,) headings at their ends, complex numbers of length one.
    odometer_m
        (M,) at least ``LEAST_M``.
    kind
        (M,) class, 0 to ``CLASSES`` - 1.
    """

    chord_m: ComplexArray
    before: ComplexArray
    after: ComplexArray
    odometer_m: FloatArray
    kind: IntArray

    @staticmethod
    def between(position_m: FloatArray, heading_rad: FloatArray, odometer_m: FloatArray) -> Legs:
        """The legs between (N, 2) stops with (N,) headings; (N,) odometer since the stop before each."""
        heading = np.exp(1j * heading_rad)
        before, after, driven = heading[:-1], heading[1:], odometer_m[1:]
        turned = np.abs(np.angle(after / before))
        kind = np.digitize(turned, TURNS_RAD) + (len(TURNS_RAD) + 1) * np.digitize(driven, LENGTHS_M)
        chord = np.diff(position_m[:, 0]) + 1j * np.diff(position_m[:, 1])
        return Legs(chord, before, after, np.maximum(driven, LEAST_M), kind)


@dataclass(frozen=True, slots=True, eq=False)
class LegModel:
    """The model's (C, 2) complex a, b and (C, 2, 2) covariances of e, per metre of odometer, by class."""

    shares: ComplexArray
    covs: FloatArray

    @staticmethod
    def fitted(legs: Legs, used: IntArray) -> LegModel:
        """Least squares over the legs ``used`` (indices), every metre of odometer alike wrong."""
        shares = np.zeros((CLASSES, 2), dtype=np.complex128)
        covs = np.zeros((CLASSES, 2, 2))
        scaled = legs.chord_m / (legs.odometer_m * legs.after)
        turned = legs.before / legs.after
        prior = np.full(2, PRIOR_SHARE, dtype=np.complex128)
        for kind in range(CLASSES):
            own = used[legs.kind[used] == kind]
            X = np.column_stack([np.ones(own.size), turned[own]])
            normal = X.conj().T @ X + PRIOR_LEGS * np.eye(2)
            shares[kind] = np.linalg.solve(normal, X.conj().T @ scaled[own] + PRIOR_LEGS * prior)
            left = scaled[own] - X @ shares[kind]
            parts = np.column_stack([left.real, left.imag])
            covs[kind] = (parts.T @ parts + PRIOR_VAR * np.eye(2)) / (own.size + 2)
        return LegModel(shares, covs)

    def predicted(self, legs: Legs) -> tuple[ComplexArray, FloatArray]:
        """(M,) chords and (M, 2, 2) covariances of what they are wrong by, in m and m^2."""
        own = self.shares[legs.kind]
        chords = legs.odometer_m * (own[:, 0] * legs.after + own[:, 1] * legs.before)
        c, s = legs.after.real, legs.after.imag
        turn = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
        covs = turn @ self.covs[legs.kind] @ turn.transpose(0, 2, 1)
        return chords, covs * np.square(legs.odometer_m)[:, None, None]
