"""The sightings of the last seconds, carried along with the robot: enough of them give a pose anew."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.localization.beacon_fix import BeaconFix, fix_from_beacons

WINDOW_S = 3.0
LEAST_READINGS = 3
_NO_MOUNT = np.zeros(3)


@dataclass(slots=True)
class _Sighting:
    t_s: float
    landmark: int
    x_m: float
    y_m: float
    moved: int
    """So many of the robot's moves it has been carried along with."""


class RecentSightings:
    """Landmarks as the robot saw them within `WINDOW_S`, in the frame that it has now.

    A camera sees one or two landmarks at a time; by its odometry the robot lays several pictures together.
    The odometry's own noise within the window is left out.
    """

    def __init__(self) -> None:
        self._seen: deque[_Sighting] = deque()
        self._moves: deque[tuple[float, float, float, float]] = deque()
        self._moved = 0

    def move(self, distance_m: float, lateral_m: float, angle_rad: float, t_s: float) -> None:
        """The robot has moved along an arc, and to its left besides; what is too old is dropped."""
        while self._seen and self._seen[0].t_s < t_s - WINDOW_S:
            self._seen.popleft()
        if distance_m == lateral_m == angle_rad == 0.0:
            return
        half_c, half_s = math.cos(0.5 * angle_rad), math.sin(0.5 * angle_rad)
        dx, dy = distance_m * half_c - lateral_m * half_s, distance_m * half_s + lateral_m * half_c
        self._moves.append((dx, dy, math.cos(angle_rad), math.sin(angle_rad)))
        self._moved += 1
        wanted = self._moved - self._seen[0].moved if self._seen else 0
        while len(self._moves) > wanted:
            self._moves.popleft()

    def _carry_along(self) -> None:
        """Lay all sightings where the robot has them now: most are dropped before anybody asks for that."""
        moves = list(self._moves)
        for sighting in self._seen:
            x, y = sighting.x_m, sighting.y_m
            for dx, dy, c, s in moves[len(moves) - (self._moved - sighting.moved) :]:
                x, y = x - dx, y - dy
                x, y = c * x + s * y, -s * x + c * y
            sighting.x_m, sighting.y_m, sighting.moved = x, y, self._moved

    def add(self, t_s: float, landmark: int, range_m: float, bearing_rad: float, mount: FloatArray) -> None:
        """Keep a sighting of the sensor at ``mount`` (x, y, theta)."""
        angle = bearing_rad + mount[2]
        x, y = mount[0] + range_m * math.cos(angle), mount[1] + range_m * math.sin(angle)
        self._seen.append(_Sighting(t_s, landmark, x, y, self._moved))

    def forget(self) -> None:
        """The robot has moved in a way that is not known."""
        self._seen.clear()

    def fix(self, points_xy_m: FloatArray, R: FloatArray, least_landmarks: int) -> BeaconFix | None:
        """Fit the robot's pose to what it saw; None where that is too little.

        Parameters
        ----------
        points_xy_m
            (L, 2) all landmarks; a sighting's number is its row.
        R
            (2, 2) covariance of a range and a bearing.
        least_landmarks
            So many different landmarks must have been seen.
        """
        rows = np.array([sighting.landmark for sighting in self._seen], dtype=np.int64)
        if rows.shape[0] < LEAST_READINGS or np.unique(rows).shape[0] < least_landmarks:
            return None
        self._carry_along()
        at = np.array([(sighting.x_m, sighting.y_m) for sighting in self._seen])
        ranges, bearings = np.hypot(at[:, 0], at[:, 1]), np.arctan2(at[:, 1], at[:, 0])
        fix = fix_from_beacons(points_xy_m[rows], ranges, bearings, _NO_MOUNT, R)
        # What a landmark's readings are off by within seconds is mostly the same: they count as one.
        return None if fix is None else replace(fix, cov=fix.cov * rows.size / np.unique(rows).size)
