"""Through a gap that only fits a footprint which stands straight to it: back off, turn, drive through."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.rolling import Scene

BEFORE_M = 0.6
BEYOND_M = 0.5
NEAR_M = 0.06
STRAIGHT_RAD = 0.03
SLOW_M_S = 0.35
SIDES_M = 0.8
LONGEST_S = 20.0


@dataclass(frozen=True, slots=True)
class NarrowPassage:
    """A gap's middle, the direction through it, and how far the manoeuvre has come.

    Stages: 0 drives to the point before the gap, backwards if that lies behind; 1 turns towards the gap;
    2 drives along its axis until beyond.
    """

    x_m: float
    y_m: float
    direction_rad: float
    stage: int
    begun_s: float

    def step(self, scene: Scene, t_s: float) -> tuple[NarrowPassage | None, Twist]:
        """The next command; None for itself when it is through or has taken too long."""
        x, y, theta = float(scene.start[0]), float(scene.start[1]), float(scene.start[2])
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        along = c * (x - self.x_m) + s * (y - self.y_m)
        across = c * (y - self.y_m) - s * (x - self.x_m)
        if t_s - self.begun_s > LONGEST_S or along > BEYOND_M:
            return None, Twist(0.0, 0.0)
        if self.stage == 0:
            tx, ty = self.x_m - BEFORE_M * c, self.y_m - BEFORE_M * s
            away = math.hypot(tx - x, ty - y)
            if away < NEAR_M:
                return self._at(1), Twist(0.0, 0.0)
            bearing = wrap(math.atan2(ty - y, tx - x) - theta)
            backwards = abs(bearing) > 0.5 * math.pi
            off = wrap(bearing - math.pi) if backwards else bearing
            turn = _limited(3.0 * off, scene.drive.turn_rate)
            if abs(off) > 0.35:
                return self, Twist(0.0, turn)
            speed = min(SLOW_M_S, 1.5 * away + 0.05)
            return self, Twist(-speed if backwards else speed, turn)
        if self.stage == 1:
            off = wrap(self.direction_rad - theta)
            if abs(off) < STRAIGHT_RAD and abs(scene.start[4]) < 0.2:
                return self._at(2), Twist(0.0, 0.0)
            return self, Twist(0.0, _limited(3.0 * off, scene.drive.turn_rate))
        # Steers back onto the axis: a heading that falls with the distance to it.
        wanted = self.direction_rad - math.atan2(across, 0.25)
        return self, Twist(SLOW_M_S, _limited(4.0 * wrap(wanted - theta), 1.0))

    def _at(self, stage: int) -> NarrowPassage:
        return NarrowPassage(self.x_m, self.y_m, self.direction_rad, stage, self.begun_s)


def find_narrow_passage(scene: Scene, ahead_m: float, t_s: float) -> NarrowPassage | None:
    """The narrowest place of the way ahead, if a footprint has to stand straight to pass it.

    Its sides are the nearest obstacle points to the left and the right of the way there; the axis is square
    to the line between them. None where the way is wide or one side is open.
    """
    path = np.ascontiguousarray(scene.path[: max(3, round(ahead_m / 0.1))])
    if path.shape[0] < 3:
        return None
    away = path_distances(path, scene.ground)
    at = min(max(int(np.argmin(away)), 1), path.shape[0] - 2)
    if away[at] > scene.body.outer_m + 0.03:
        return None
    tangent = path[at + 1] - path[at - 1]
    sides = _sides(scene, path[at], tangent / max(float(np.hypot(*tangent)), 1e-9))
    if sides is None:
        return None
    left, right = sides
    middle = 0.5 * (left + right)
    width = left - right
    # Square to the line between the sides, left on the left.
    direction = math.atan2(-width[0], width[1])
    return NarrowPassage(float(middle[0]), float(middle[1]), direction, 0, t_s)


def _sides(scene: Scene, place: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The nearest pair of obstacle points across a place, one on either side of the way."""
    n = scene.ground.hits.shape[0]
    rows, columns = np.nonzero(scene.ground.hits)
    points = scene.ground.mean[rows * n + columns]
    offset = points - place
    near = np.hypot(offset[:, 0], offset[:, 1]) < SIDES_M
    points, offset = points[near], offset[near]
    across = tangent[0] * offset[:, 1] - tangent[1] * offset[:, 0]
    left, right = points[across > 0.02], points[across < -0.02]
    if not (left.shape[0] and right.shape[0]):
        return None
    apart = np.hypot(left[:, None, 0] - right[None, :, 0], left[:, None, 1] - right[None, :, 1])
    i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
    return left[i], right[j]


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)
