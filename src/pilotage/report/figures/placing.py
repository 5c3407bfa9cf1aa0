"""Finds room for labels on a map: near their place, off the lines, off each other."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray

_DIRECTIONS = np.array(
    [[math.cos(a), math.sin(a)] for a in np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)]
)


MOST_PLACES = 10_000
"""Of one line: a picture is a few hundred places wide, and a line may leave one of a tiny body far behind."""


class LabelPlacer:
    """Greedy placing by cost: what a label would cover, and how far it stands from its place.

    Parameters
    ----------
    occupied
        (n, 3) places that should stay visible: x, y and the price of covering them.
    limits
        x_min, y_min, x_max, y_max that labels keep within. All lengths in one unit, such as points.
    """

    def __init__(self, occupied: FloatArray, limits: tuple[float, float, float, float]) -> None:
        self._occupied = occupied
        self._limits = limits

    def place(
        self, x: float, y: float, half_width: float, half_height: float, reach: FloatArray
    ) -> tuple[float, float]:
        """Return the centre of the label for a place, and keep it for the labels to come.

        Parameters
        ----------
        x, y
            The place that the label belongs to.
        half_width, half_height
            Half the label's size.
        reach
            Distances between the place and the label's edge to try, nearest first.
        """
        # The label's own half size in each direction, so that its edge is as far away sideways as above.
        out = np.maximum(np.abs(_DIRECTIONS[:, :1]) * half_width, np.abs(_DIRECTIONS[:, 1:]) * half_height)
        centres = np.concatenate([_DIRECTIONS * (out + distance) for distance in reach]) + np.array([x, y])
        distances = np.repeat(reach, len(_DIRECTIONS))
        room = np.array([half_width + 1.5, half_height + 1.5])
        low, high = centres.min(axis=0) - room, centres.max(axis=0) + room
        places = self._occupied[:, :2]
        # Most of a map is nowhere near.
        near = self._occupied[((places > low) & (places < high)).all(axis=1)]
        dx, dy = np.abs(near[:, 0] - centres[:, :1]), np.abs(near[:, 1] - centres[:, 1:])
        covered = ((dx < room[0]) & (dy < room[1])) @ near[:, 2]
        x_min, y_min, x_max, y_max = self._limits
        outside = (
            (centres[:, 0] - half_width < x_min)
            | (centres[:, 0] + half_width > x_max)
            | (centres[:, 1] - half_height < y_min)
            | (centres[:, 1] + half_height > y_max)
        )
        cost = covered + 0.08 * distances + 1e3 * outside
        best_x, best_y = centres[int(np.argmin(cost))]
        self.occupy(float(best_x), float(best_y), half_width, half_height)
        return float(best_x), float(best_y)

    def occupy(self, x: float, y: float, half_width: float, half_height: float) -> None:
        """Keep a rectangle free of labels to come."""
        columns = np.linspace(-half_width, half_width, 5)
        rows = np.linspace(-half_height, half_height, 3)
        xs, ys = np.meshgrid(x + columns, y + rows)
        corners = np.stack([xs.ravel(), ys.ravel(), np.full(xs.size, 8.0)], axis=1)
        self._occupied = np.concatenate([self._occupied, corners])


def along(points: FloatArray, spacing: float, price: float) -> FloatArray:
    """Return (n, 3) places along a polyline (k, 2) at a spacing, with their price; NaN points are skipped.

    Of a line that is too long for its spacing there are ``MOST_PLACES``, as much farther apart.
    """
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.empty((0, 3))
    steps = np.hypot(*np.diff(points, axis=0).T) if len(points) > 1 else np.zeros(0)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    spacing = max(spacing, travelled[-1] / (MOST_PLACES - 1))
    places = np.arange(0.0, travelled[-1] + spacing, spacing)
    xs, ys = (np.interp(places, travelled, points[:, axis]) for axis in (0, 1))
    return np.stack([xs, ys, np.full(len(places), price)], axis=1)
