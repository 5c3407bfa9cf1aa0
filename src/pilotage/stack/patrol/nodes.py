"""The nodes that times to go are worked out on: where the body fits, how slow it is, what room there is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.field import sample_distance
from pilotage.maps.distance_field import DistanceField

EASY_M, TIGHT_FACTOR = 0.5, 1.0
"""Nearer to walls than this, beyond the body, a metre takes longer: twice as long where it just fits."""
DIRECTIONS, CLIMBS_M, CLIMB_RATIO = 24, (0.1, 0.3, 0.1, 0.05), 0.65
"""Steps away from walls, in the best of so many directions. Up to the middle the distance grows by as much as
the step, beyond it along a room's corner by seven tenths (by long steps, as distances between their nodes are
rough), along a door in a thin wall by less than this share."""
FINER, MOST_POINTS = (5, 3), 6_000_000
"""What has room for two is looked for at points so many times as near, while there are no more than that."""
BEYOND_M = 0.1
"""Passages are as wide as they are up to so much more than two need."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """What nodes are laid over.

    Attributes
    ----------
    field
        Distances to what is on the map.
    bounds_m
        Of the map.
    clearance_m
        What the body's middle keeps from that.
    speed_m_s
        Where there is room.
    lane_m
        What robots keep from the middle of a passage that has room for two.
    """

    field: DistanceField
    bounds_m: tuple[float, float, float, float]
    clearance_m: float
    speed_m_s: float
    lane_m: float

    def nodes(self, spacing_m: float, *, exact: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(rows, columns) seconds a metre, infinite where the body does not fit; and half widths.

        The first is the most room there is beside a node, also before and behind a door in a thin wall, which
        may be narrower by some decimetres: what passages are settled by. The second is the door's own.
        Row 0 has the lowest y. Between its nodes the field leaves no room in passages that the body just
        fits through; ``exact`` distances do, where walls are known as lines.
        """
        xmin, ymin, xmax, ymax = self.bounds_m
        xs = np.arange(xmin, xmax + 0.5 * spacing_m, spacing_m)
        ys = np.arange(ymin, ymax + 0.5 * spacing_m, spacing_m)
        grid = np.stack(np.meshgrid(xs, ys), axis=-1)
        if exact:
            distance = self._exact(spacing_m, *grid.shape[:2])
        else:
            distance = self.field.at(grid.reshape(-1, 2)).reshape(grid.shape[:2])
        slowness = self._slowness(distance)
        fine = self._fine(spacing_m, distance)
        return slowness, self._room(spacing_m, fine, distance.shape), self._half_widths(fine, grid, distance)

    def _slowness(self, distance: FloatArray) -> FloatArray:
        tight = np.clip(1.0 - (distance - self.clearance_m) / EASY_M, 0.0, 1.0)
        slow = (1.0 + TIGHT_FACTOR * tight**2) / self.speed_m_s
        return np.where(distance >= self.clearance_m, slow, np.inf)

    def slowness_at(self, places_xy_m: FloatArray) -> FloatArray:
        """(rows, columns) seconds a metre at places (rows, columns, 2), as ``nodes``."""
        return self._slowness(self.field.at(places_xy_m.reshape(-1, 2)).reshape(places_xy_m.shape[:2]))

    def _fine(self, spacing_m: float, distance: FloatArray) -> DistanceField:
        """Distances at points nearer to each other, exact where walls are known.

        Between nodes a corridor's middle seems nearer to its walls, by up to half of what they are apart: it
        would have room for two or not by where nodes happen to lie.
        """
        most = FINER[0] if self.knows_walls else max(1, round(spacing_m / self.field.resolution_m))
        finer = next((f for f in FINER if f <= most and f * f * distance.size <= MOST_POINTS), 1)
        rows, columns = (finer * (n - 1) + 1 for n in distance.shape)
        (x0, y0), step_m = self.bounds_m[:2], spacing_m / finer
        if self.knows_walls:
            values = self._exact(step_m, rows, columns)
        else:
            xs, ys = x0 + step_m * np.arange(columns), y0 + step_m * np.arange(rows)
            values = self.field.at(np.stack(np.meshgrid(xs, ys), axis=-1)).reshape(rows, columns)
        return DistanceField(values, (x0, y0), step_m, self.field.segments_m, self.field.circles_m)

    @property
    def knows_walls(self) -> bool:
        """Whether they are known as lines and discs."""
        return len(self.field.segments_m) + len(self.field.circles_m) > 0

    def _exact(self, step_m: float, rows: int, columns: int) -> FloatArray:
        """(rows, columns) distances at points so far apart."""
        walls = self.field.segments_m, self.field.circles_m
        return sample_distance(*self.bounds_m[:2], step_m, columns, rows, *walls)

    def _room(self, spacing_m: float, fine: DistanceField, shape: tuple[int, ...]) -> FloatArray:
        """(rows, columns) the most room there is beside a node, no farther than a lane."""
        finer = round(spacing_m / fine.resolution_m)
        reach = min(math.ceil(self.lane_m / spacing_m), max(shape))
        room_m = scipy.ndimage.maximum_filter(fine.distance_m, size=2 * finer * reach + 1)
        return np.ascontiguousarray(room_m[::finer, ::finer])

    def _half_widths(self, fine: DistanceField, grid: FloatArray, distance: FloatArray) -> FloatArray:
        """(rows, columns) half the width of the passage that a node lies in, or one beside it.

        The distance in its middle: where the way up from the node ends. Before and behind a door in a
        thin wall there is more room, but that is not its width.
        """
        free = distance >= self.clearance_m
        enough_m = self.clearance_m + max(self.clearance_m, self.lane_m) + BEYOND_M
        half_m = np.where(free, distance, np.inf)
        low = np.flatnonzero(free & (distance < enough_m))
        places, widest = grid.reshape(-1, 2)[low], distance.reshape(-1)[low]
        angles = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
        around = np.column_stack([np.cos(angles), np.sin(angles)])
        for climb_m in CLIMBS_M:
            climbs = np.arange(len(low))
            while len(climbs):
                steps = places[climbs][:, None] + climb_m * around
                found = self.field.at(steps.reshape(-1, 2)).reshape(-1, DIRECTIONS)
                best = np.argmax(found, axis=1)
                highest = found[np.arange(len(climbs)), best]
                on = highest >= widest[climbs] + CLIMB_RATIO * climb_m
                places[climbs[on]], widest[climbs[on]] = steps[on, best[on]], highest[on]
                climbs = climbs[on & (highest < enough_m)]
        # The middle itself lies within half of what the field's nodes are apart.
        ring = around[::4]
        for off_m in (0.5 * self.field.resolution_m, self.field.resolution_m):
            found = fine.at((places[:, None] + off_m * ring).reshape(-1, 2)).reshape(-1, len(ring))
            widest = np.maximum(widest, found.max(axis=1, initial=0.0))
        half_m.reshape(-1)[low] = widest
        # Ways between nodes pass some that are too near to a wall.
        return np.where(free, half_m, scipy.ndimage.minimum_filter(half_m, size=3))
